#pragma once
#include <utility>
#include <vector>

#include "whirl/expr/expr.hpp"

namespace whirl::expr::detail {

inline constexpr std::size_t kMaxDepth = 500;
inline constexpr std::size_t kMaxSize = 100000;

struct ExprNode {
  Expr::Kind kind = Expr::Kind::number;
  Function function = Function::abs;
  double value = 0;
  std::string name;
  std::vector<Expr> args;
  std::size_t hash = 0;
  std::size_t size = 1;
  std::size_t depth = 1;

  /// Wraps a finished node: computes hash, size and depth, and refuses what is too large.
  static Expr make(ExprNode node);
};

/// Base and exponent of a factor: (x, 3) of x^3, (x, 1) of anything else.
std::pair<Expr, Expr> base_exponent(const Expr& e);
bool is_integer(const Expr& e);
/// Never negative where it is defined.
bool non_negative(const Expr& e);
/// Value of the function; y only for min and max.
double apply(Function function, double x, double y);
/// Natural order of names: X2 before X10.
int compare_names(const std::string& a, const std::string& b);
struct NaturalOrder {
  bool operator()(const std::string& a, const std::string& b) const { return compare_names(a, b) < 0; }
};

}  // namespace whirl::expr::detail
