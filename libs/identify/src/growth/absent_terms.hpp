#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "output_error/rotor/output_error_problem.hpp"

namespace whirl::identification::detail {

/// A term with one real coefficient that a rotor model lacks, as the trajectory sees it.
struct AbsentTerm {
  const TermEntry* term;
  double score = 0;          ///< fall of twice the negative logarithm of the likelihood, to first order
  double value = 0, sd = 0;  ///< coefficient that it would get; sd from the noise alone
  /// By how much k1, k2, c and then eps (real, imaginary) of every record move per unit of that coefficient.
  Eigen::VectorXd moves;
};

/// Score test (Rao 1948) of `terms` and, with `sensor`, of the axes of the y probe, each alone, on the free runs of
/// `fit`: one integration with the sensitivities of all of them. Terms that `active` has are left out. It has the
/// power of the likelihood, which the weak equations of score_rotor_terms do not reach where damping is low; it knows
/// neither modes nor runout. `fit` must come from `records` with `active` and `forces`.
std::vector<AbsentTerm> absent_terms(const std::vector<RotorRecord>& records, const OutputErrorFit& fit,
                                     const OutputErrorOptions& active, const std::vector<RotorTerm>& terms, bool sensor,
                                     const KnownForces& forces);

}  // namespace whirl::identification::detail
