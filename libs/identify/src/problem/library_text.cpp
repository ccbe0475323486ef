#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/sindy_library.hpp"

namespace whirl::identification {
namespace {

std::string strip(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

}  // namespace

std::vector<std::string> library_terms(const SindyOptions& options, const LibraryChoice& choice) {
  std::vector<std::string> names = options.states;
  if (options.order == 2) {
    for (const std::string& s : options.states) names.push_back(s + "'");
  }
  names.insert(names.end(), options.inputs.begin(), options.inputs.end());
  if (choice.time) names.emplace_back("t");
  std::vector<std::vector<expr::Expr>> parts;
  const bool only_terms = !choice.terms.empty() && choice.degree == 0 && choice.fourier == 0;
  const int usual = choice.quadratic || names.size() > 3 ? 2 : 3;
  if (!only_terms) parts.push_back(expr::polynomial_library(names, choice.degree > 0 ? choice.degree : usual));
  if (choice.fourier > 0) parts.push_back(expr::fourier_library(names, choice.fourier));
  parts.push_back(expr::parse_library(choice.terms));
  std::vector<std::string> library;
  for (const expr::Expr& e : expr::union_library(parts)) library.push_back(e.str());
  return library;
}

Equation known_equation(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) throw Error::in_field("--known", text, "an equation, e.g. \"x' = v\"");
  Equation e{strip(text.substr(0, equals)), {}};
  const expr::Expr right = expr::expand(expr::Expr::parse(text.substr(equals + 1)));
  const std::vector<expr::Expr> summands =
      right.kind() == expr::Expr::Kind::sum ? right.args() : std::vector<expr::Expr>{right};
  for (const expr::Expr& s : summands) {
    const auto [number, function] = expr::split_coefficient(s);
    e.terms.push_back({function.str(), {number, 0, number, number}, ""});
  }
  return e;
}

SignBound sign_bound(const std::string& text) {
  const auto refuse = [&] {
    return Error::in_field("--sign", text, "TERM=+, TERM=-, EQUATION:TERM=+ or EQUATION:TERM=-, e.g. \"v':x^3=-\"");
  };
  const auto equals = text.rfind('=');
  if (equals == std::string::npos) throw refuse();
  const std::string sign = strip(text.substr(equals + 1)), left = text.substr(0, equals);
  const auto colon = left.find(':');
  SignBound bound;
  bound.equation = colon == std::string::npos ? "" : strip(left.substr(0, colon));
  bound.function = strip(colon == std::string::npos ? left : left.substr(colon + 1));
  if ((sign != "+" && sign != "-") || bound.function.empty() || colon == 0) throw refuse();
  bound.sign = sign == "+" ? 1 : -1;
  return bound;
}

}  // namespace whirl::identification
