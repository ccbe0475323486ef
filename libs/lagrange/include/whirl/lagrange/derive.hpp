#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/expr/library.hpp"

namespace whirl::lagrange {

/// A constant of the machine. `value` NaN: not known. A known value without `sd` counts as exact.
struct PhysicalParameter {
  std::string name;
  std::string unit;  ///< SI, as Unit::parse reads it; empty: not stated
  Estimate value;
  bool known() const { return value.value == value.value; }
  bool exact() const { return known() && !(value.sd > 0); }
};

/// A measured motion, e.g. the rotor angle: its rates are columns of the record, not unknowns.
struct PrescribedSignal {
  std::string name;
  std::string acceleration;  ///< law of its second derivative (a motor's torque law over J); empty: measured too
};

/// A mechanical system by its energies. All texts are terms of `expr` in the coordinates and prescribed signals with a
/// prime per derivative (x, x'), the inputs, the parameters and the time t.
struct LagrangeProblem {
  std::vector<std::string> coordinates;      ///< e.g. {"x", "y"}
  std::vector<PrescribedSignal> prescribed;  ///< e.g. {{"beta", ""}}
  std::vector<std::string> inputs;           ///< forces and voltages that act from outside, e.g. {"ux", "uy"}
  std::vector<PhysicalParameter> parameters;
  std::string kinetic;                                     ///< T
  std::string potential;                                   ///< V
  std::string rayleigh;                                    ///< dissipation function R, force -dR/d(rate); empty: none
  std::map<std::string, std::string, std::less<>> forces;  ///< further generalised forces, by coordinate
  /// Symmetries of V and R: "rotation x y [u v ...]" (of all pairs by one angle), "mirror x [y ...]", "exchange x y".
  /// Parameters are tied so that V and R keep their value under them.
  std::vector<std::string> symmetries;
  std::vector<std::string> positive;  ///< variables that keep a positive sign on the record: sgn is 1, abs is left out
  std::map<std::string, int, std::less<>>
      order;  ///< highest power of a small parameter that is kept in the accelerations
  /// Names in the library, e.g. {{"x", "X1"}, {"x'", "X2"}}; a derivative without an entry is its base with a prime.
  std::map<std::string, std::string, std::less<>> names;
};

/// What Lagrange's equations of the second kind (paper eq. 1) give: d/dt(dT/dq') - dT/dq + dV/dq = Q - dR/dq'.
struct LagrangeEquations {
  std::vector<std::string> coordinates;
  /// M(q) q'' = h(q, q', t): rows by equation, columns by coordinate. With a mass matrix that no state enters (after
  /// sin^2 + cos^2 = 1) `accelerations` solve it, else row i solved for its own acceleration alone, and `implicit` is
  /// true.
  std::vector<std::vector<expr::Expr>> mass;
  std::vector<expr::Expr> rhs;            ///< h, expanded
  expr::Expr determinant;                 ///< of M
  std::vector<expr::Expr> accelerations;  ///< q'', then the laws of prescribed signals, expanded
  std::vector<std::string> lhs;           ///< of the accelerations, e.g. "x''"
  bool implicit = false;                  ///< other accelerations stand on the right-hand sides
  /// Candidates: accelerations split into unknown (parameters only) times function (states only) with one group per
  /// unknown: the ties. Unknowns whose functions depend linearly on others' are merged with these, so that the groups
  /// are independent of each other. Terms whose parameters all have exact values are in `known`. In the names of
  /// `LagrangeProblem::names`.
  expr::CandidateLibrary library;
  std::vector<std::string> notes;  ///< what the symmetries tied, what was truncated
};

/// An entry of `LagrangeProblem::names` and what is wrong with it.
struct NameProblem {
  std::string variable, reason;
};
/// None when every variable (each with its rate and acceleration, and t) has a name of its own that is an identifier.
std::optional<NameProblem> name_problem(const LagrangeProblem& problem);

/// Derives the equations by computer algebra (GiNaC). Throws Error with the text and the reason when a text cannot be
/// parsed or uses an undeclared name, a symmetry cannot be had, the kinetic energy has no mass for a coordinate, or a
/// parameter without value stands inside a function of the states, so that the equations are not linear in unknowns.
LagrangeEquations derive(const LagrangeProblem& problem);

}  // namespace whirl::lagrange
