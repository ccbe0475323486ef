#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/stiffness_law.hpp"

namespace whirl::modal {

struct StiffnessOptions {
  double confidence = 0.95;  ///< of the intervals in the result, in (0.5, 1)
  bool fit_offset = true;    ///< false: the zero of the deflection gauge is known to be the unloaded position (d0 = 0)
  double deflection_sd = 0;  ///< standard deviation of the gauge, m; 0 = none
  bool leave_out_outliers = true;  ///< name and leave out points far off the law of the others
};

/// Shaft stiffness from a static force-deflection table (paper eq. 12, with the gauge zero d0 free):
///
///   F = K1 (d - d0) + K2 (d - d0)^3
///
/// `deflection` in m, `force` in N, in the order in which they were measured. Least squares on the force, or orthogonal
/// distances where the gauge states its standard deviation. Outliers (one table in a thousand without any shows one)
/// are named and left out. Intervals from the t distribution with n - 3 degrees of freedom; `cubic_p_value` is the
/// two-sided t test of K2 = 0. When the table turns back (loading, then unloading), the largest difference of the two
/// branches is reported as hysteresis, and warned about when the scatter does not explain it. Warns about an offset
/// that is significant and about too few points. Where a zero offset of the force explains the table as well as one of
/// the gauge (a pull to one side), it is named, and the intervals of K1 and K2 cover what they are then. Throws Error
/// for unequal lengths, values that are not finite, or fewer than 4 different deflections.
StiffnessLaw fit_stiffness(const Eigen::Ref<const Eigen::VectorXd>& deflection,
                           const Eigen::Ref<const Eigen::VectorXd>& force, const StiffnessOptions& options = {});

/// A force-deflection table taken along one direction of the x-y plane.
struct DirectedStiffnessTable {
  double angle = 0;            ///< of the pull, rad from x towards y
  Eigen::VectorXd deflection;  ///< along the pull, m
  Eigen::VectorXd force;       ///< N
};

/// Linear stiffness as a tensor: k(phi) = mean + amplitude cos(2 (phi - axis)).
struct AnisotropicStiffness {
  std::vector<StiffnessLaw> laws;  ///< one per table, in order
  Estimate mean;                   ///< (Kx + Ky)/2, N/m
  Estimate amplitude;              ///< half the difference of the principal stiffnesses, N/m, >= 0
  double axis = 0;                 ///< direction of largest stiffness, rad in (-pi/2, pi/2]
  double p_value = 1;  ///< probability of a difference this large on an isotropic shaft; 1 when it cannot be tested
  Summary summary;
};

/// Fits every table, then the tensor to the K1 found (weighted by their variances). Needs three different directions,
/// modulo pi, for all three entries; with two at right angles the coupling Kxy is taken as zero and a warning says so.
AnisotropicStiffness fit_anisotropic_stiffness(const std::vector<DirectedStiffnessTable>& tables,
                                               const StiffnessOptions& options = {});

}  // namespace whirl::modal
