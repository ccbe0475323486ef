// Derivative, substitution and expansion: terms to terms.
#include <algorithm>
#include <set>

#include "node.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::expr {

using Kind = Expr::Kind;

namespace {

bool uses(const Expr& e, std::string_view variable) {
  if (e.kind() == Kind::symbol) return e.name() == variable;
  return std::any_of(e.args().begin(), e.args().end(), [&](const Expr& arg) { return uses(arg, variable); });
}

/// d function(args) / d args[0]; min and max are handled by their symmetry.
Expr outer_derivative(const Expr& e, std::size_t which) {
  const Expr& x = e.args()[0];
  switch (e.function()) {
    case Function::abs:
      return sgn(x);
    case Function::sgn:
      return Expr(0);
    case Function::exp:
      return e;
    case Function::log:
      return pow(x, -1);
    case Function::sin:
      return cos(x);
    case Function::cos:
      return -sin(x);
    case Function::tan:
      return Expr(1) + pow(e, 2);
    case Function::tanh:
      return Expr(1) - pow(e, 2);
    case Function::min:
    case Function::max: {
      const Expr difference = e.args()[which] - e.args()[1 - which];
      return (Expr(1) + Expr(e.function() == Function::max ? 1 : -1) * sgn(difference)) / 2;
    }
  }
  return Expr(0);
}

}  // namespace

Expr differentiate(const Expr& e, std::string_view variable) {
  switch (e.kind()) {
    case Kind::number:
      return Expr(0);
    case Kind::symbol:
      return Expr(e.name() == variable ? 1 : 0);
    case Kind::sum: {
      std::vector<Expr> terms;
      for (const Expr& arg : e.args()) terms.push_back(differentiate(arg, variable));
      return Expr::sum(std::move(terms));
    }
    case Kind::product: {
      std::vector<Expr> terms;
      for (std::size_t i = 0; i < e.args().size(); ++i) {
        if (!uses(e.args()[i], variable)) continue;
        std::vector<Expr> factors = e.args();
        factors[i] = differentiate(factors[i], variable);
        terms.push_back(Expr::product(std::move(factors)));
      }
      return Expr::sum(std::move(terms));
    }
    case Kind::power: {
      const Expr &base = e.args()[0], &exponent = e.args()[1];
      std::vector<Expr> terms;
      if (uses(base, variable)) terms.push_back(exponent * pow(base, exponent - 1) * differentiate(base, variable));
      if (uses(exponent, variable))
        terms.push_back(e * Expr::call(Function::log, {base}) * differentiate(exponent, variable));
      return Expr::sum(std::move(terms));
    }
    case Kind::function: {
      std::vector<Expr> terms;
      for (std::size_t i = 0; i < e.args().size(); ++i) {
        if (uses(e.args()[i], variable)) terms.push_back(outer_derivative(e, i) * differentiate(e.args()[i], variable));
      }
      return Expr::sum(std::move(terms));
    }
  }
  return Expr(0);
}

namespace {

Expr rebuild(const Expr& e, std::vector<Expr> args) {
  switch (e.kind()) {
    case Kind::function:
      return Expr::call(e.function(), std::move(args));
    case Kind::power:
      return pow(args[0], args[1]);
    case Kind::product:
      return Expr::product(std::move(args));
    case Kind::sum:
      return Expr::sum(std::move(args));
    default:
      return e;
  }
}

}  // namespace

Expr substitute(const Expr& e, const std::map<std::string, Expr, std::less<>>& values) {
  if (e.kind() == Kind::symbol) {
    const auto it = values.find(e.name());
    return it == values.end() ? e : it->second;
  }
  if (e.args().empty()) return e;
  std::vector<Expr> args;
  for (const Expr& arg : e.args()) args.push_back(substitute(arg, values));
  return rebuild(e, std::move(args));
}

namespace {

std::vector<Expr> terms_of(const Expr& e) { return e.kind() == Kind::sum ? e.args() : std::vector<Expr>{e}; }

Expr multiply_out(const Expr& a, const Expr& b) {
  const std::vector<Expr> left = terms_of(a), right = terms_of(b);
  if (left.size() * right.size() > detail::kMaxSize) throw Error("expansion has too many terms");
  std::vector<Expr> terms;
  for (const Expr& x : left) {
    for (const Expr& y : right) terms.push_back(x * y);
  }
  return Expr::sum(std::move(terms));
}

}  // namespace

Expr expand(const Expr& e) {
  if (e.args().empty()) return e;
  std::vector<Expr> args;
  for (const Expr& arg : e.args()) args.push_back(expand(arg));
  if (e.kind() == Kind::product) {
    Expr result(1);
    for (const Expr& arg : args) result = multiply_out(result, arg);
    return result;
  }
  if (e.kind() == Kind::power && args[0].kind() == Kind::sum && detail::is_integer(args[1]) && args[1].value() > 1 &&
      args[1].value() <= 20) {
    Expr result = args[0];
    for (int n = 1; n < static_cast<int>(args[1].value()); ++n) result = multiply_out(result, args[0]);
    return result;
  }
  return rebuild(e, std::move(args));
}

namespace {

void collect(const Expr& e, std::set<std::string, detail::NaturalOrder>& names) {
  if (e.kind() == Kind::symbol) names.insert(e.name());
  for (const Expr& arg : e.args()) collect(arg, names);
}

}  // namespace

std::vector<std::string> variables(const Expr& e) {
  std::set<std::string, detail::NaturalOrder> names;
  collect(e, names);
  return {names.begin(), names.end()};
}

}  // namespace whirl::expr
