#include "whirl/expr/expr.hpp"

#include <algorithm>
#include <cmath>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl {

using detail::base_exponent;
using detail::ExprNode;
using detail::is_integer;
using detail::non_negative;
using Kind = Expr::Kind;

namespace detail {

Expr ExprNode::make(ExprNode node) {
  const auto mix = [&node](std::size_t h) { node.hash ^= h + 0x9e3779b97f4a7c15ULL + (node.hash << 6) + (node.hash >> 2); };
  node.hash = static_cast<std::size_t>(node.kind) * 31 + static_cast<std::size_t>(node.function);
  if (node.kind == Kind::number) mix(std::hash<double>{}(node.value));
  if (node.kind == Kind::symbol) mix(std::hash<std::string>{}(node.name));
  node.size = 1;
  node.depth = 1;
  for (const Expr& arg : node.args) {
    mix(arg.hash());
    node.size += arg.size();
    node.depth = std::max(node.depth, arg.depth() + 1);
  }
  if (node.depth > kMaxDepth) throw Error(fmt::format("term nested {} levels deep: at most {} allowed", node.depth, kMaxDepth));
  if (node.size > kMaxSize) throw Error(fmt::format("term of {} nodes: at most {} allowed", node.size, kMaxSize));
  return Expr(std::make_shared<const ExprNode>(std::move(node)));
}

std::pair<Expr, Expr> base_exponent(const Expr& e) {
  if (e.kind() == Kind::power) return {e.args()[0], e.args()[1]};
  return {e, Expr(1)};
}

bool is_integer(const Expr& e) { return e.is_number() && e.value() == std::floor(e.value()) && std::abs(e.value()) < 1e9; }

bool non_negative(const Expr& e) {
  switch (e.kind()) {
    case Kind::number: return e.value() >= 0;
    case Kind::function: return e.function() == Function::abs || e.function() == Function::exp;
    case Kind::power: {
      const Expr& n = e.args()[1];
      return (n.is_number() && (!is_integer(n) || std::fmod(n.value(), 2) == 0)) || non_negative(e.args()[0]);
    }
    case Kind::product:
    case Kind::sum: return std::all_of(e.args().begin(), e.args().end(), non_negative);
    case Kind::symbol: return false;
  }
  return false;
}

int compare_names(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  const auto number_end = [&](const std::string& s, std::size_t k) {
    while (k < s.size() && digit(s[k])) ++k;
    return k;
  };
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t ai = i, bj = j;
      while (ai < a.size() && a[ai] == '0') ++ai;
      while (bj < b.size() && b[bj] == '0') ++bj;
      const std::size_t ae = number_end(a, ai), be = number_end(b, bj);
      if (ae - ai != be - bj) return ae - ai < be - bj ? -1 : 1;
      if (const int c = a.compare(ai, ae - ai, b, bj, be - bj)) return c;
      i = ae;
      j = be;
    } else {
      if (a[i] != b[j]) return a[i] < b[j] ? -1 : 1;
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) return i < a.size() ? 1 : -1;
  return a.compare(b);  // differ by leading zeros only
}

namespace {

int sign(double d) { return d < 0 ? -1 : d > 0 ? 1 : 0; }

/// Neither number, power nor product.
int compare_atoms(const Expr& a, const Expr& b) {
  if (a.kind() != b.kind()) return a.kind() < b.kind() ? -1 : 1;
  switch (a.kind()) {
    case Kind::number: return sign(a.value() - b.value());
    case Kind::symbol: return compare_names(a.name(), b.name());
    default: break;
  }
  if (a.kind() == Kind::function && a.function() != b.function()) return a.function() < b.function() ? -1 : 1;
  const std::size_t n = std::min(a.args().size(), b.args().size());
  for (std::size_t i = 0; i < n; ++i) {
    if (const int c = compare(a.args()[i], b.args()[i])) return c;
  }
  return a.args().size() == b.args().size() ? 0 : a.args().size() < b.args().size() ? -1 : 1;
}

int compare_factors(const Expr& a, const Expr& b) {
  if (a.kind() != Kind::power && b.kind() != Kind::power) return compare_atoms(a, b);
  const auto [base_a, exponent_a] = base_exponent(a);
  const auto [base_b, exponent_b] = base_exponent(b);
  if (const int c = compare(base_a, base_b)) return c;
  return compare(exponent_a, exponent_b);
}

struct Factors {
  double coefficient = 1;
  const Expr* begin = nullptr;
  const Expr* end = nullptr;
};

Factors factors_of(const Expr& e) {
  if (e.is_number()) return {e.value(), nullptr, nullptr};
  if (e.kind() != Kind::product) return {1, &e, &e + 1};
  const Expr* begin = e.args().data();
  const Expr* end = begin + e.args().size();
  if (begin->is_number()) return {begin->value(), begin + 1, end};
  return {1, begin, end};
}

}  // namespace
}  // namespace detail

int compare(const Expr& a, const Expr& b) {
  if (a.node_ == b.node_) return 0;
  const detail::Factors fa = detail::factors_of(a), fb = detail::factors_of(b);
  const Expr *pa = fa.begin, *pb = fb.begin;
  for (; pa != fa.end && pb != fb.end; ++pa, ++pb) {
    if (const int c = detail::compare_factors(*pa, *pb)) return c;
  }
  if (pa != fa.end || pb != fb.end) return pa != fa.end ? 1 : -1;
  return detail::sign(fa.coefficient - fb.coefficient);
}

std::string_view to_string(Function function) {
  static constexpr std::string_view names[] = {"abs", "sgn", "exp", "log", "sin", "cos", "tan", "tanh", "min", "max"};
  return names[static_cast<std::size_t>(function)];
}

Expr::Expr(double value) {
  if (!std::isfinite(value)) throw Error(fmt::format("constant {} in a term: must be finite", value));
  ExprNode node;
  node.value = value == 0 ? 0.0 : value;  // no negative zero: equal terms hash equal
  *this = ExprNode::make(std::move(node));
}

Expr Expr::symbol(std::string_view name) {
  ExprNode node;
  node.kind = Kind::symbol;
  node.name = name;
  return ExprNode::make(std::move(node));
}

Kind Expr::kind() const { return node_->kind; }
double Expr::value() const { return node_->value; }
const std::string& Expr::name() const { return node_->name; }
Function Expr::function() const { return node_->function; }
const std::vector<Expr>& Expr::args() const { return node_->args; }
std::size_t Expr::hash() const { return node_->hash; }
std::size_t Expr::size() const { return node_->size; }
std::size_t Expr::depth() const { return node_->depth; }

std::pair<double, Expr> split_coefficient(const Expr& e) {
  if (e.is_number()) return {e.value(), Expr(1)};
  if (e.kind() != Kind::product || !e.args()[0].is_number()) return {1.0, e};
  std::vector<Expr> rest(e.args().begin() + 1, e.args().end());
  if (rest.size() == 1) return {e.args()[0].value(), rest[0]};
  ExprNode node;
  node.kind = Kind::product;
  node.args = std::move(rest);
  return {e.args()[0].value(), ExprNode::make(std::move(node))};
}

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
  std::stable_sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return compare(a.second, b.second) < 0; });
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
  if (merged.size() > 1) {  // (-a - b) c = -(a + b) c
    for (Expr& factor : merged) {
      if (factor.kind() != Kind::sum || !leading_minus(factor)) continue;
      factor = -factor;
      coefficient = -coefficient;
    }
  }
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
      throw Error(fmt::format("{}^({}) is not a finite real number", number_text(base.value()), number_text(exponent.value())));
    }
    return Expr(value);
  }
  const bool integer = is_integer(exponent);
  if (base.kind() == Kind::power && exponent.is_number()) {
    const Expr& inner = base.args()[1];
    if (inner.is_number() &&
        ((integer && is_integer(inner)) || exponent.is_number(-1) || non_negative(base.args()[0]))) {
      return pow(base.args()[0], Expr(inner.value() * exponent.value()));
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
  if (base.kind() == Kind::function && integer) {
    if (base.function() == Function::abs && std::fmod(exponent.value(), 2) == 0) return pow(base.args()[0], exponent);
    if (base.function() == Function::exp) return exp(exponent * base.args()[0]);
  }
  ExprNode node;
  node.kind = Kind::power;
  node.args = {base, exponent};
  return ExprNode::make(std::move(node));
}

namespace {

double apply(Function function, double x, double y) {
  switch (function) {
    case Function::abs: return std::abs(x);
    case Function::sgn: return (x > 0) - (x < 0);
    case Function::exp: return std::exp(x);
    case Function::log: return std::log(x);
    case Function::sin: return std::sin(x);
    case Function::cos: return std::cos(x);
    case Function::tan: return std::tan(x);
    case Function::tanh: return std::tanh(x);
    case Function::min: return x < y ? x : y;
    case Function::max: return x > y ? x : y;
  }
  return 0;
}

}  // namespace

Expr Expr::call(Function function, std::vector<Expr> arguments) {
  const bool two = function == Function::min || function == Function::max;
  if (arguments.size() != (two ? 2u : 1u)) {
    throw Error(fmt::format("{} takes {} argument{}, found {}", to_string(function), two ? 2 : 1, two ? "s" : "", arguments.size()));
  }
  const Expr& x = arguments[0];
  if (std::all_of(arguments.begin(), arguments.end(), [](const Expr& a) { return a.is_number(); })) {
    const double value = apply(function, x.value(), arguments.back().value());
    if (!std::isfinite(value)) throw Error(fmt::format("{}({}) is not a finite number", to_string(function), number_text(x.value())));
    return Expr(value);
  }
  if (two) {
    if (compare(arguments[0], arguments[1]) == 0) return arguments[0];
    if (compare(arguments[0], arguments[1]) > 0) std::swap(arguments[0], arguments[1]);
  } else if (leading_minus(x)) {
    if (function == Function::abs || function == Function::cos) return call(function, {-x});
    if (function == Function::sgn || function == Function::sin || function == Function::tan || function == Function::tanh) {
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

Expr operator+(const Expr& a, const Expr& b) { return Expr::sum({a, b}); }
Expr operator-(const Expr& a, const Expr& b) { return Expr::sum({a, -b}); }
Expr operator-(const Expr& a) { return Expr::product({Expr(-1), a}); }
Expr operator*(const Expr& a, const Expr& b) { return Expr::product({a, b}); }
Expr operator/(const Expr& a, const Expr& b) { return Expr::product({a, pow(b, Expr(-1))}); }
Expr sin(const Expr& x) { return Expr::call(Function::sin, {x}); }
Expr cos(const Expr& x) { return Expr::call(Function::cos, {x}); }
Expr exp(const Expr& x) { return Expr::call(Function::exp, {x}); }
Expr abs(const Expr& x) { return Expr::call(Function::abs, {x}); }
Expr sgn(const Expr& x) { return Expr::call(Function::sgn, {x}); }

double evaluate(const Expr& e, const std::map<std::string, double, std::less<>>& values) {
  switch (e.kind()) {
    case Kind::number: return e.value();
    case Kind::symbol: {
      const auto it = values.find(e.name());
      if (it == values.end()) throw Error(fmt::format("no value given for variable {}", e.name()));
      return it->second;
    }
    case Kind::function: {
      const double x = evaluate(e.args()[0], values);
      return apply(e.function(), x, e.args().size() > 1 ? evaluate(e.args()[1], values) : x);
    }
    case Kind::power: {
      const double x = evaluate(e.args()[0], values);
      return e.args()[1].is_number(0.5) ? std::sqrt(x) : std::pow(x, evaluate(e.args()[1], values));
    }
    case Kind::product: {
      double v = 1;
      for (const Expr& arg : e.args()) v *= evaluate(arg, values);
      return v;
    }
    case Kind::sum: {
      double v = 0;
      for (const Expr& arg : e.args()) v += evaluate(arg, values);
      return v;
    }
  }
  return 0;
}

}  // namespace whirl
