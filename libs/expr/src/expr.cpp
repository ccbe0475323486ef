#include "whirl/expr/expr.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl::expr {

using detail::base_exponent;
using detail::ExprNode;
using Kind = Expr::Kind;

namespace detail {

Expr ExprNode::make(ExprNode node) {
  const auto mix = [&node](std::size_t h) {
    node.hash ^= h + 0x9e3779b97f4a7c15ULL + (node.hash << 6) + (node.hash >> 2);
  };
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
  if (node.depth > kMaxDepth)
    throw Error(fmt::format("term nested {} levels deep: at most {} allowed", node.depth, kMaxDepth));
  if (node.size > kMaxSize) throw Error(fmt::format("term of {} nodes: at most {} allowed", node.size, kMaxSize));
  return Expr(std::make_shared<const ExprNode>(std::move(node)));
}

std::pair<Expr, Expr> base_exponent(const Expr& e) {
  if (e.kind() == Kind::power) return {e.args()[0], e.args()[1]};
  return {e, Expr(1)};
}

bool is_integer(const Expr& e) {
  return e.is_number() && e.value() == std::floor(e.value()) && std::abs(e.value()) < 1e9;
}

bool non_negative(const Expr& e) {
  switch (e.kind()) {
    case Kind::number:
      return e.value() >= 0;
    case Kind::function:
      return e.function() == Function::abs || e.function() == Function::exp;
    case Kind::power: {
      const Expr& n = e.args()[1];
      return (n.is_number() && (!is_integer(n) || std::fmod(n.value(), 2) == 0)) || non_negative(e.args()[0]);
    }
    case Kind::product:
    case Kind::sum:
      return std::all_of(e.args().begin(), e.args().end(), non_negative);
    case Kind::symbol:
      return false;
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
    case Kind::number:
      return sign(a.value() - b.value());
    case Kind::symbol:
      return compare_names(a.name(), b.name());
    default:
      break;
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

namespace detail {

double apply(Function function, double x, double y) {
  switch (function) {
    case Function::abs:
      return std::abs(x);
    case Function::sgn:
      return (x > 0) - (x < 0);
    case Function::exp:
      return std::exp(x);
    case Function::log:
      return std::log(x);
    case Function::sin:
      return std::sin(x);
    case Function::cos:
      return std::cos(x);
    case Function::tan:
      return std::tan(x);
    case Function::tanh:
      return std::tanh(x);
    case Function::min:
      return x < y ? x : y;
    case Function::max:
      return x > y ? x : y;
  }
  return 0;
}

}  // namespace detail

double evaluate(const Expr& e, const std::map<std::string, double, std::less<>>& values) {
  switch (e.kind()) {
    case Kind::number:
      return e.value();
    case Kind::symbol: {
      const auto it = values.find(e.name());
      if (it == values.end()) throw Error(fmt::format("no value given for variable {}", e.name()));
      return it->second;
    }
    case Kind::function: {
      const double x = evaluate(e.args()[0], values);
      return detail::apply(e.function(), x, e.args().size() > 1 ? evaluate(e.args()[1], values) : x);
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

}  // namespace whirl::expr
