#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Solves z + g sig(z)^r = x for z (monotone, one root), 0 < r < 1, g >= 0.
double solve_implicit_power(double x, double g, double exponent) noexcept;

/// Implicit terminal sliding mode as a velocity set-point: one backward Euler step on the surface never
/// evaluates the singular term.  z + h C phi(z) = x,  v* = (z - x)/h,  a = -f + clamp((v* - v)/tau, -rho,
/// rho);  s = v - v*.
struct ImplicitTerminalSmc {
  double surface_gain = 60, switching_gain = 3;
  double tau = 4e-3;  ///< s; 3 to 5 h with noise or delay
  double exponent = 0.7, length = 1e-3;
  double sample_time = 1e-3;

  AxisOutput step(const AxisInput& in) noexcept {
    const double z = length * solve_implicit_power(in.x / length, sample_time * surface_gain, exponent);
    const double s = in.v - (z - in.x) / sample_time;
    return {-in.f + std::clamp(-s / tau, -switching_gain, switching_gain), s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
