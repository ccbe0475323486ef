#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Implicit (backward Euler) linear sliding mode: the sign function solved at the next sample is a projection
/// (Acary, Brogliato, Orlov, IEEE TAC 2012):  a = -f - C v - clamp(s / tau, -rho, rho), s = v + C x. tau = h
/// without delay (layer exactly h rho); with n samples of delay tau >= h (n+1)^(n+1)/n^n.
struct ImplicitSmc {
  double surface_gain = 60, switching_gain = 3;
  double tau = 4e-3;  ///< s

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    return {-(in.f + surface_gain * in.v + std::clamp(s / tau, -switching_gain, switching_gain)), s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
