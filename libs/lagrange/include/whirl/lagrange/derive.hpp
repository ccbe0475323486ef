#pragma once
#include <string>
#include <vector>

namespace whirl {

/// A mechanical system by its energies. All texts are expressions of `expr` in the coordinates, their rates (`d` before the
/// name: x, dx) and the parameters.
struct LagrangeProblem {
  std::vector<std::string> coordinates;  ///< e.g. {"x", "y", "b"}
  std::vector<std::string> parameters;   ///< positive constants and prescribed inputs, e.g. {"m", "K1", "tau"}
  std::string kinetic;                   ///< T
  std::string potential;                 ///< V
  std::string rayleigh;                  ///< dissipation function R, force -dR/d(rate); empty: none
  std::vector<std::string> forces;       ///< further generalised forces Q_i, one per coordinate; empty: none
};

/// M(q) q'' = h(q, q'), by Lagrange's equations of the second kind (paper eq. 1):
/// d/dt(dT/dq') - dT/dq + dV/dq = Q - dR/dq'.
struct LagrangeEquations {
  std::vector<std::vector<std::string>> mass;  ///< M, rows by equation, columns by coordinate
  std::vector<std::string> rhs;                ///< h, expanded
  std::vector<std::vector<std::string>> terms; ///< summands of each h_i, one candidate with its coefficient each
  std::string determinant;                     ///< of M, simplified
};

/// Derives the equations by computer algebra (GiNaC). Throws Error when a text cannot be parsed, uses an undeclared name, or
/// the numbers of coordinates and forces differ.
LagrangeEquations derive(const LagrangeProblem& problem);

}  // namespace whirl
