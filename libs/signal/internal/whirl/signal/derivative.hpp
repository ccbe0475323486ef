#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// First derivative by central differences, valid part only: `order`/2 samples are lost at each end.
///
///   order 4 (paper eq. 15):  x'(i) = [-x(i+2) + 8 x(i+1) - 8 x(i-1) + x(i-2)] / (12 h)
///
/// `x` in any unit, `dt` > 0 in s, `order` 2, 4 or 6. Result of size N - order; throws Error when x is too short.
Eigen::VectorXd central_difference(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int order = 4);

/// A smoothed signal with its derivatives on the same grid.
struct SmoothedSignal {
  Eigen::VectorXd value, first, second;
};

/// Natural cubic smoothing spline: minimises sum (x_i - g(t_i))^2 + lambda * integral g''^2 dt (Reinsch 1967).
/// lambda in s^3, >= 0. One banded solve, O(N).
SmoothedSignal smoothing_spline(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double lambda);

/// The same with lambda found so that the rms residual equals `noise_sd` (Reinsch's discrepancy rule; unit of x).
SmoothedSignal smoothing_spline_for_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd);

}  // namespace whirl::signal
