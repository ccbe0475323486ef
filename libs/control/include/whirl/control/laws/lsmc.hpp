#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Linear sliding mode: s = v + C x, a = -[ f + C v + rho tanh(s / eps) ]. Exponential decay on the surface,
/// rate C.
struct LinearSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1;

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x;
    return {-(in.f + surface_gain * in.v + switching_gain * smooth_sign(s / boundary_layer)), s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
