#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "whirl/expr/expr.hpp"

namespace whirl::expr {

/// Product of powers of unit symbols. N, J, W, Pa and Hz are reduced to kg, m, s; rad is 1; V, A, K and any other
/// symbol stand for themselves.
class Unit {
 public:
  Unit() = default;  ///< dimensionless
  /// Reads "m/s^2", "kg m^2", "1/(m^2 s^2)", "N/m^3", "rad/s", "1", "" (dimensionless). Throws Error otherwise.
  static Unit parse(std::string_view text);
  /// "m/s^2", "1/(m^2 s^2)"; "1" when dimensionless.
  std::string str() const;
  bool dimensionless() const { return powers_.empty(); }
  /// Made of kg, m, s, A, K and V only: no "mm", no "lbf".
  bool is_si() const;
  Unit power(double exponent) const;
  friend Unit operator*(const Unit& a, const Unit& b);
  friend Unit operator/(const Unit& a, const Unit& b);
  friend bool operator==(const Unit&, const Unit&) = default;

 private:
  std::map<std::string, double> powers_;
};

using UnitMap = std::map<std::string, Unit, std::less<>>;

/// Unit of a term, its numbers taken as dimensionless. None when it has no meaning: a variable without unit, a sum of
/// different units, a sine of metres.
std::optional<Unit> unit_of(const Expr& e, const UnitMap& units);
/// Unit text of the coefficient of `term` in an equation with left-hand side in `lhs`; "" when the term has no unit.
std::string coefficient_unit(const Expr& term, const Unit& lhs, const UnitMap& units);

/// Units of X1..X7 = x, x', y, y', beta, beta', beta'' (paper eq. 22), ux and uy in N, t in s.
const UnitMap& rotor_units();

}  // namespace whirl::expr
