#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Nonsingular terminal sliding mode (Feng, Yu, Man, Automatica 2002), the same surface as TerminalSmc solved
/// for x, scaled to a velocity, g = 1/r in (1, 2):
///   s = C x + C L sig(v/(C L))^g,  a = -[ f + (C/g) C L sig(v/(C L))^(2-g) + rho tanh(s / eps) ].
/// No singular term; reaching is slower near v = 0 where the surface is flat. Sliding time: that of
/// TerminalSmc.
struct NonsingularTerminalSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1, exponent = 0.7, length = 1e-3;

  AxisOutput step(const AxisInput& in) noexcept {
    const double g = 1 / exponent, unit = surface_gain * length;
    const double s = surface_gain * in.x + unit * sig(in.v / unit, g);
    return {
        -(in.f + surface_gain / g * unit * sig(in.v / unit, 2 - g) + switching_gain * smooth_sign(s / boundary_layer)),
        s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
