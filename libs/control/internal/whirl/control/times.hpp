#pragma once
#include <cmath>
#include <limits>

namespace whirl::control {

/// Closed-form times and residuals of sliding modes. They hold for the switching law (sgn); a boundary layer
/// or a sampled loop reaches a residual set instead of the origin. Infinite where the condition of the
/// formula is not met.

/// Upper bound of the time to reach s = 0: |s(0)| / (rho - D_max), from paper eqs. 38-42 (kappa = rho -
/// D_max).
inline double reach_time(double s0, double rho, double disturbance) noexcept {
  const double kappa = rho - disturbance;
  return kappa > 0 ? std::abs(s0) / kappa : std::numeric_limits<double>::infinity();
}

/// Sliding time on v + C L sig(x/L)^r = 0 from x (the quantity of paper eq. 30): L |x/L|^(1-r) / (C (1-r)) /
/// L.
inline double slide_time_terminal(double x, double surface_gain, double exponent, double length = 1e-3) noexcept {
  if (!(exponent < 1)) return std::numeric_limits<double>::infinity();
  return std::pow(std::abs(x) / length, 1 - exponent) / (surface_gain * (1 - exponent));
}

/// Sliding time on v + a x + C L sig(x/L)^r = 0 (fast terminal surface, Yu and Man 2002).
inline double slide_time_fast_terminal(double x, double linear_gain, double surface_gain, double exponent,
                                       double length = 1e-3) noexcept {
  if (linear_gain <= 0) return slide_time_terminal(x, surface_gain, exponent, length);
  return std::log1p(linear_gain / surface_gain * std::pow(std::abs(x) / length, 1 - exponent)) /
         (linear_gain * (1 - exponent));
}

/// Bound of |s| that the tanh layer leaves: eps atanh(D_max / rho).
inline double layer_residual(double epsilon, double rho, double disturbance) noexcept {
  return disturbance < rho ? epsilon * std::atanh(disturbance / rho) : std::numeric_limits<double>::infinity();
}

/// Bound of |x| on the terminal surface when |s| <= phi: L (phi / (C L))^(1/r).
inline double position_residual(double phi, double surface_gain, double exponent, double length = 1e-3) noexcept {
  return length * std::pow(phi / (surface_gain * length), 1 / exponent);
}

}  // namespace whirl::control
