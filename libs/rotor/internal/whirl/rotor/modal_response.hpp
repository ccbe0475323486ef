#pragma once
#include <Eigen/Core>

namespace whirl::rotor {

/// Response q at the samples to F on the half grid: q'' + 2 zeta w q' + w^2 q = F from steady state at sample 0 (the
/// first speed `omega0`), advanced exactly for an F quadratic over each step, so that w dt may exceed 1. `derivative`:
/// 1 or 2 gives q' or q'' instead.
Eigen::VectorXcd modal_response(double w, double zeta, const Eigen::VectorXcd& forcing, double dt, double omega0,
                                int derivative = 0);

}  // namespace whirl::rotor
