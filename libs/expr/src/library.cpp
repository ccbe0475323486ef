#include "whirl/expr/library.hpp"

#include <algorithm>
#include <unordered_set>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl {

std::vector<Expr> polynomial_library(const std::vector<std::string>& variables, int high, int low) {
  if (low < 0 || high < low || high > 20) throw Error(fmt::format("polynomial library of degrees {} to {}: must be 0 <= low <= high <= 20", low, high));
  std::vector<Expr> level{Expr(1)}, terms;
  std::vector<std::size_t> first{0};  // lowest variable that a monomial of the level may still be multiplied with
  if (low == 0) terms = level;
  for (int degree = 1; degree <= high; ++degree) {
    std::vector<Expr> next;
    std::vector<std::size_t> next_first;
    for (std::size_t k = 0; k < level.size(); ++k) {
      for (std::size_t v = first[k]; v < variables.size(); ++v) {
        next.push_back(level[k] * Expr::symbol(variables[v]));
        next_first.push_back(v);
      }
    }
    if (next.size() > detail::kMaxSize) throw Error(fmt::format("polynomial library of degree {} in {} variables is too large", high, variables.size()));
    level = std::move(next);
    first = std::move(next_first);
    if (degree >= low) terms.insert(terms.end(), level.begin(), level.end());
  }
  return terms;
}

std::vector<Expr> fourier_library(const std::vector<std::string>& variables, int harmonics) {
  if (harmonics < 1) throw Error(fmt::format("Fourier library of {} harmonics: must be 1 or more", harmonics));
  std::vector<Expr> terms;
  for (const std::string& name : variables) {
    for (int k = 1; k <= harmonics; ++k) {
      terms.push_back(sin(Expr(k) * Expr::symbol(name)));
      terms.push_back(cos(Expr(k) * Expr::symbol(name)));
    }
  }
  return terms;
}

std::vector<Expr> parse_library(const std::vector<std::string>& terms) {
  std::vector<Expr> result;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    try {
      result.push_back(Expr::parse(terms[i]));
    } catch (const Error& error) {
      throw Error(fmt::format("library entry {}: {}", i + 1, error.what()));
    }
  }
  return result;
}

std::vector<Expr> rotor_library() {
  return parse_library({"1", "X1", "X1^3", "X2", "X6^2*cos(X5)", "X6^2*sin(X5)", "X6*cos(X5)", "X6*sin(X5)", "X3", "X3^3", "X4",
                        "X1*X3^2", "X1^2*X3", "X6", "X6^2", "sin(X5)", "cos(X5)"});
}

std::vector<std::vector<Expr>> lateral_library() {
  const std::vector<Expr> forcing = parse_library({"X6^2*cos(X5)", "X6^2*sin(X5)", "cos(X5)", "sin(X5)"});
  return {union_library({parse_library({"X1", "X1^3", "X1*X3^2", "X2"}), forcing}),
          union_library({parse_library({"X3", "X3^3", "X1^2*X3", "X4"}), forcing})};
}

std::vector<Expr> modal_library(const std::vector<std::complex<double>>& poles, double onset) {
  const Expr t = Expr::symbol("t") - onset;
  const Expr gate = onset == 0 ? Expr(1) : (Expr(1) + sgn(t)) / 2;
  std::vector<Expr> terms;
  for (const std::complex<double>& pole : poles) {
    const Expr decay = gate * exp(Expr(pole.real()) * t), angle = Expr(pole.imag()) * t;
    terms.push_back(decay * cos(angle));
    if (pole.imag() != 0) terms.push_back(decay * sin(angle));
  }
  return terms;
}

std::vector<Expr> product_library(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  std::vector<Expr> terms;
  for (const Expr& x : a) {
    for (const Expr& y : b) terms.push_back(x * y);
  }
  return union_library({terms});
}

std::vector<Expr> union_library(const std::vector<std::vector<Expr>>& libraries) {
  std::unordered_set<Expr> seen;
  std::vector<Expr> terms;
  for (const std::vector<Expr>& library : libraries) {
    for (const Expr& term : library) {
      if (!term.is_number(0) && seen.insert(split_coefficient(term).second).second) terms.push_back(term);
    }
  }
  return terms;
}

namespace {

/// Unit of "v'": that of v per second; none when v has none.
std::optional<Unit> unit_of_rate(const std::string& lhs, const UnitMap& units) {
  if (lhs.empty() || lhs.back() != '\'') return unit_of(Expr::symbol(lhs), units);
  const std::optional<Unit> inner = unit_of_rate(lhs.substr(0, lhs.size() - 1), units);
  if (!inner) return std::nullopt;
  return *inner / Unit::parse("s");
}

void set_variables(CandidateLibrary& library) {
  std::vector<Expr> functions;
  for (const TiedGroup& group : library.groups) {
    for (const TiedEntry& entry : group.entries) functions.push_back(entry.function);
  }
  std::vector<std::string>& names = library.variables;
  for (const Expr& function : functions) {
    for (std::string& name : variables(function)) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end(), [](const auto& a, const auto& b) { return detail::compare_names(a, b) < 0; });
  names.erase(std::unique(names.begin(), names.end()), names.end());
}

}  // namespace

CandidateLibrary untied_library(const std::vector<std::string>& lhs, const std::vector<std::vector<Expr>>& functions,
                                const UnitMap& units) {
  if (lhs.size() != functions.size()) throw Error(fmt::format("library for {} equations given for {}", functions.size(), lhs.size()));
  CandidateLibrary library;
  library.lhs = lhs;
  for (std::size_t i = 0; i < lhs.size(); ++i) {
    const std::optional<Unit> unit = unit_of_rate(lhs[i], units);
    for (const Expr& function : functions[i]) {
      library.groups.push_back({function.str(), {{i, function, 1.0}}, "", unit ? coefficient_unit(function, *unit, units) : ""});
    }
  }
  set_variables(library);
  return library;
}

CandidateLibrary tied_rotor_library(bool offset, bool anisotropic, bool control) {
  CandidateLibrary library;
  library.lhs = {"X2'", "X4'"};
  const auto add = [&](std::string name, const char* x, const char* y, std::string coefficient, std::string unit) {
    library.groups.push_back({std::move(name), {}, std::move(coefficient), std::move(unit)});
    const auto entry = [&](std::size_t equation, const char* text) {
      // A sum stays one function; a single term gives its number to the factor.
      const auto [factor, function] = split_coefficient(Expr::parse(text));
      if (factor != 0) library.groups.back().entries.push_back({equation, function, factor});
    };
    entry(0, x);
    entry(1, y);
  };
  add("k1", "-X1", "-X3", "K1/m", "1/s^2");
  add("k2", "-X1*(X1^2 + X3^2)", "-X3*(X1^2 + X3^2)", "K2/m", "1/(m^2 s^2)");
  add("c", "-X2", "-X4", "C/m", "1/s");
  add("eps_re", "X6^2*cos(X5) + X7*sin(X5)", "X6^2*sin(X5) - X7*cos(X5)", "e*cos(phi)", "m");
  add("eps_im", "-X6^2*sin(X5) + X7*cos(X5)", "X6^2*cos(X5) + X7*sin(X5)", "e*sin(phi)", "m");
  if (anisotropic) {  // -k1_conj conj(z) - c_conj conj(z')
    add("k1_conj_re", "-X1", "X3", "(Kx - Ky)/(2*m)", "1/s^2");
    add("k1_conj_im", "-X3", "-X1", "Kxy/m", "1/s^2");
    add("c_conj_re", "-X2", "X4", "(Cx - Cy)/(2*m)", "1/s");
    add("c_conj_im", "-X4", "-X2", "Cxy/m", "1/s");
  }
  if (control) add("gain", "ux", "uy", "1/m", "1/kg");
  if (offset) {
    add("d_re", "1", "0", "", "m/s^2");
    add("d_im", "0", "1", "", "m/s^2");
  }
  set_variables(library);
  return library;
}

}  // namespace whirl
