#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Terminal sliding mode, paper eq. 43 with the input gain carried explicitly (outside):
///   s = v + C phi(x),  a = -[ f + C phi'(x) v + rho tanh(s / eps) ],  phi(x) = L sig(x/L)^r.
/// Regularisation::none is the printed law. rho > D_max reaches |s| <= eps atanh(D_max / rho) (times.hpp).
struct TerminalSmc {
  double surface_gain = 60;     ///< C, 1/s
  double switching_gain = 3;    ///< rho, m/s^2
  double boundary_layer = 0.1;  ///< eps, m/s
  TerminalPower power;
  TerminalPower::Edge edge = {};

  AxisOutput step(const AxisInput& in) noexcept {
    const TerminalPower::Point phi = power.at(in.x, edge);
    const double s = in.v + surface_gain * phi.value;
    return {-(in.f + surface_gain * phi.slope * in.v + switching_gain * smooth_sign(s / boundary_layer)), s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
