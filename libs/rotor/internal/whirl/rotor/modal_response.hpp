#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::rotor {

/// Response q at the samples to F on the half grid: q'' + 2 zeta w q' + w^2 q = F from steady state at sample 0 (the
/// first speed `omega0`), advanced exactly for an F quadratic over each step, so that w dt may exceed 1. `derivative`:
/// 1 or 2 gives q' or q'' instead.
Eigen::VectorXcd modal_response(double w, double zeta, const Eigen::VectorXcd& forcing, double dt, double omega0,
                                int derivative = 0);

/// Undamped frequency, rad/s, and damping ratio.
struct Pole {
  double w, zeta;
};
/// modal_response of at most eight poles at once, at every `every`-th sample; the work on F is shared.
std::vector<Eigen::VectorXcd> modal_responses(const std::vector<Pole>& poles, const Eigen::VectorXcd& forcing,
                                              double dt, double omega0, int derivative, Eigen::Index every);

}  // namespace whirl::rotor
