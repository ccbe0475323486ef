// The canonical form: how sums, products, powers and calls are put together.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl::expr {

using detail::base_exponent;
using detail::ExprNode;
using detail::is_integer;
using detail::non_negative;
using Kind = Expr::Kind;

namespace {

/// number * rest where rest has no number and is not a sum.
Expr scale(double coefficient, const Expr& rest) {
  if (coefficient == 1) return rest;
  ExprNode node;
  node.kind = Kind::product;
  node.args.emplace_back(coefficient);
  if (rest.kind() == Kind::product) {
    node.args.insert(node.args.end(), rest.args().begin(), rest.args().end());
  } else {
    node.args.push_back(rest);
  }
  return ExprNode::make(std::move(node));
}

bool leading_minus(const Expr& e) {
  const Expr& first = e.kind() == Kind::sum ? e.args()[0] : e;
  return split_coefficient(first).first < 0;
}

}  // namespace

Expr Expr::sum(std::vector<Expr> terms) {
  std::vector<std::pair<double, Expr>> parts;
  double constant = 0;
  const auto add = [&](const Expr& term) {
    if (term.is_number()) {
      constant += term.value();
    } else {
      parts.push_back(split_coefficient(term));
    }
  };
  for (const Expr& term : terms) {
    if (term.kind() == Kind::sum) {
      for (const Expr& inner : term.args()) add(inner);
    } else {
      add(term);
    }
  }
  std::stable_sort(parts.begin(), parts.end(),
                   [](const auto& a, const auto& b) { return compare(a.second, b.second) < 0; });
  ExprNode node;
  node.kind = Kind::sum;
  for (std::size_t i = 0; i < parts.size();) {
    double coefficient = 0;
    const std::size_t first = i;
    for (; i < parts.size() && parts[i].second == parts[first].second; ++i) coefficient += parts[i].first;
    if (coefficient != 0) node.args.push_back(scale(coefficient, parts[first].second));
  }
  if (constant != 0 || node.args.empty()) node.args.emplace_back(constant);
  return node.args.size() == 1 ? node.args[0] : ExprNode::make(std::move(node));
}

Expr Expr::product(std::vector<Expr> factors) {
  double coefficient = 1;
  std::vector<Expr> flat;
  const auto collect = [&](const Expr& factor) {
    if (factor.is_number()) {
      coefficient *= factor.value();
    } else {
      flat.push_back(factor);
    }
  };
  for (const Expr& factor : factors) {
    if (factor.kind() == Kind::product) {
      for (const Expr& inner : factor.args()) collect(inner);
    } else {
      collect(factor);
    }
  }
  if (coefficient == 0) return Expr(0);
  if (flat.size() > 1) {  // (-a - b) c = -(a + b) c, before factors of one base are sought
    for (Expr& factor : flat) {
      if (factor.kind() != Kind::sum || !leading_minus(factor)) continue;
      factor = -factor;
      coefficient = -coefficient;
    }
  }
  const auto order = [](const Expr& a, const Expr& b) { return compare(a, b) < 0; };
  std::stable_sort(flat.begin(), flat.end(), order);
  // Factors of one base are neighbours. Integer exponents add up; others only when the base cannot be negative.
  std::vector<Expr> merged;
  bool changed = false;
  for (std::size_t i = 0; i < flat.size();) {
    const Expr base = base_exponent(flat[i]).first;
    const bool all = non_negative(base);
    std::vector<Expr> exponents, kept;
    std::size_t count = 0;
    for (; i < flat.size() && base_exponent(flat[i]).first == base; ++i) {
      const Expr exponent = base_exponent(flat[i]).second;
      if (all || is_integer(exponent)) {
        exponents.push_back(exponent);
        ++count;
      } else {
        kept.push_back(flat[i]);
      }
    }
    if (count == 1) {
      merged.push_back(pow(base, exponents[0]));
    } else if (count > 1) {
      const Expr joined = pow(base, Expr::sum(exponents));
      changed = changed || joined.kind() != Kind::power || !(joined.args()[0] == base);
      merged.push_back(joined);
    }
    merged.insert(merged.end(), kept.begin(), kept.end());
  }
  if (changed) {  // a merged power may be a number, a product or a base met before
    merged.emplace_back(coefficient);
    return product(std::move(merged));
  }
  if (merged.empty()) return Expr(coefficient);
  std::stable_sort(merged.begin(), merged.end(), order);
  if (merged.size() == 1 && merged[0].kind() == Kind::sum) {
    if (coefficient == 1) return merged[0];
    std::vector<Expr> terms;
    for (const Expr& term : merged[0].args()) terms.push_back(product({Expr(coefficient), term}));
    return sum(std::move(terms));
  }
  if (merged.size() == 1) return scale(coefficient, merged[0]);
  ExprNode node;
  node.kind = Kind::product;
  if (coefficient != 1) node.args.emplace_back(coefficient);
  node.args.insert(node.args.end(), merged.begin(), merged.end());
  return ExprNode::make(std::move(node));
}

Expr pow(const Expr& base, const Expr& exponent) {
  if (exponent.is_number(0)) return Expr(1);
  if (exponent.is_number(1)) return base;
  if (base.is_number(1)) return Expr(1);
  if (base.is_number() && exponent.is_number()) {
    const double value = std::pow(base.value(), exponent.value());
    if (!std::isfinite(value)) {
      throw Error(
          fmt::format("{}^({}) is not a finite real number", number_text(base.value()), number_text(exponent.value())));
    }
    return Expr(value);
  }
  const bool integer = is_integer(exponent);
  if (base.kind() == Kind::power) {
    // (b^i)^e = b^(i e) for b >= 0, for whole numbers, and for a reciprocal, which has the domain of b^i.
    const Expr& inner = base.args()[1];
    if ((integer && is_integer(inner)) || exponent.is_number(-1) || non_negative(base.args()[0])) {
      return pow(base.args()[0], inner * exponent);
    }
  }
  if (base.kind() == Kind::product && integer) {
    std::vector<Expr> factors;
    for (const Expr& factor : base.args()) factors.push_back(pow(factor, exponent));
    return Expr::product(std::move(factors));
  }
  if (base.kind() == Kind::sum && integer && leading_minus(base)) {
    return std::fmod(exponent.value(), 2) == 0 ? pow(-base, exponent) : -pow(-base, exponent);
  }
  if (base.kind() == Kind::function) {
    if (integer && base.function() == Function::abs && std::fmod(exponent.value(), 2) == 0)
      return pow(base.args()[0], exponent);
    if (base.function() == Function::exp) return exp(exponent * base.args()[0]);
  }
  ExprNode node;
  node.kind = Kind::power;
  node.args = {base, exponent};
  return ExprNode::make(std::move(node));
}

Expr Expr::call(Function function, std::vector<Expr> arguments) {
  const bool two = function == Function::min || function == Function::max;
  if (arguments.size() != (two ? 2u : 1u)) {
    throw Error(fmt::format("{} takes {} argument{}, found {}", to_string(function), two ? 2 : 1, two ? "s" : "",
                            arguments.size()));
  }
  const Expr& x = arguments[0];
  if (std::all_of(arguments.begin(), arguments.end(), [](const Expr& a) { return a.is_number(); })) {
    const double value = detail::apply(function, x.value(), arguments.back().value());
    if (!std::isfinite(value))
      throw Error(fmt::format("{}({}) is not a finite number", to_string(function), number_text(x.value())));
    return Expr(value);
  }
  if (two) {
    if (compare(arguments[0], arguments[1]) == 0) return arguments[0];
    if (compare(arguments[0], arguments[1]) > 0) std::swap(arguments[0], arguments[1]);
  } else if (leading_minus(x)) {
    if (function == Function::abs || function == Function::cos) return call(function, {-x});
    if (function == Function::sgn || function == Function::sin || function == Function::tan ||
        function == Function::tanh) {
      return -call(function, {-x});
    }
  }
  if (function == Function::abs && non_negative(x)) return x;
  ExprNode node;
  node.kind = Kind::function;
  node.function = function;
  node.args = std::move(arguments);
  return ExprNode::make(std::move(node));
}

}  // namespace whirl::expr
