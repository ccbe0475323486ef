#pragma once

namespace whirl::control {

/// Gains [kp, kd] (1/s^2, 1/s) of the discrete linear-quadratic regulator of x'' = -k1 x - c x' + a, input
/// held over h: minimises the sum of (x / x_scale)^2 + (v / v_scale)^2 + (a / a_scale)^2. With a pure input
/// delay the optimal law is the same gain on the predicted state. Source: discrete Riccati equation, iterated
/// to its fixed point.
struct LqrGains {
  double kp = 0, kd = 0;
  double residual = 0;         ///< of the Riccati equation, relative
  double spectral_radius = 0;  ///< of the closed loop without delay
};
LqrGains lqr_gains(double k1, double c, double sample_time, double x_scale, double v_scale, double a_scale);

}  // namespace whirl::control
