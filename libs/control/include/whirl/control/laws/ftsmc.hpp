#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Fast terminal sliding mode (Yu, Man, IEEE TCAS-I 2002): s = v + alpha x + C phi(x), linear decay far out
/// and terminal near 0:  a = -[ f + (alpha + C phi'(x)) v + rho tanh(s / eps) ]. Sliding time:
/// slide_time_fast_terminal.
struct FastTerminalSmc {
  double linear_gain = 30;  ///< alpha, 1/s
  double surface_gain = 30, switching_gain = 3, boundary_layer = 0.1;
  TerminalPower power;
  TerminalPower::Edge edge = {};

  AxisOutput step(const AxisInput& in) noexcept {
    const TerminalPower::Point phi = power.at(in.x, edge);
    const double s = in.v + linear_gain * in.x + surface_gain * phi.value;
    return {
        -(in.f + (linear_gain + surface_gain * phi.slope) * in.v + switching_gain * smooth_sign(s / boundary_layer)),
        s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
