#pragma once
#include <Eigen/Core>

namespace whirl::signal {

/// First derivative by central differences, valid part only: `order`/2 samples are lost at each end.
///
///   order 4 (paper eq. 15):  x'(i) = [-x(i+2) + 8 x(i+1) - 8 x(i-1) + x(i-2)] / (12 h)
///
/// `x` in any unit, `dt` > 0 in s, `order` 2, 4 or 6. Result of size N - order; throws Error when x is too short.
Eigen::VectorXd central_difference(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int order = 4);

/// k-th derivative (k = 0..4) of the band-limited part of x below `cutoff_hz`, same size as x.
///
/// The line through the two end points is removed and the rest continued oddly, so that the periodic continuation is
/// smooth in value and slope; multiplication by (i w)^k with a cosine roll-off from 0.9 to 1.0 of the cutoff.
/// The first and last few periods of the cutoff frequency carry end effects. 0 < cutoff_hz <= 1/(2 dt).
Eigen::VectorXd spectral_derivative(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int k, double cutoff_hz);

/// A smoothed signal with its derivatives on the same grid.
struct SmoothedSignal {
  Eigen::VectorXd value, first, second;
};

/// Natural cubic smoothing spline: minimises sum (x_i - g(t_i))^2 + lambda * integral g''^2 dt (Reinsch 1967).
/// lambda in s^3, >= 0. One banded solve, O(N).
SmoothedSignal smoothing_spline(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double lambda);

/// The same with lambda found so that the rms residual equals `noise_sd` (Reinsch's discrepancy rule; unit of x).
SmoothedSignal smoothing_spline_for_noise(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double noise_sd);

/// Derivative of x with total-variation regularisation, for jumping derivatives: the difference quotient of
///
///   g = argmin 1/2 sum (g_i - x_i)^2 + alpha sum |u_{i+1} - u_i|,  u_i = (g_{i+1} - g_i) / dt
///
/// by lagged diffusivity (Chartrand 2011; Vogel and Oman 1996), one pentadiagonal solve per iteration. alpha > 0, in
/// the unit of x times s. Same size as x.
Eigen::VectorXd total_variation_derivative(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, double alpha,
                                           int iterations = 50);

}  // namespace whirl::signal
