#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Nonsingular fast terminal sliding mode (Yang, Yang, Nonlinear Dynamics 2011), 1 < g = 1/r < 2, g < a1 =
/// fast_exponent:
///   s = C [ x + kappa L sig(x/L)^a1 ] + C L sig(v/(C L))^g,
///   a = -[ f + (C/g) C L sig(v/(C L))^(2-g) (1 + kappa a1 |x/L|^(a1-1)) + rho tanh(s / eps) ].
struct NonsingularFastTerminalSmc {
  double surface_gain = 60, switching_gain = 3, boundary_layer = 0.1, exponent = 0.7, length = 1e-3;
  double fast_gain = 0.2;      ///< kappa, dimensionless
  double fast_exponent = 1.8;  ///< a1 > 1/r

  AxisOutput step(const AxisInput& in) noexcept {
    const double g = 1 / exponent, unit = surface_gain * length, ratio = in.x / length;
    const double s =
        surface_gain * (in.x + fast_gain * length * sig(ratio, fast_exponent)) + unit * sig(in.v / unit, g);
    const double slope = 1 + fast_gain * fast_exponent * std::pow(std::abs(ratio), fast_exponent - 1);
    return {-(in.f + surface_gain / g * unit * sig(in.v / unit, 2 - g) * slope +
              switching_gain * smooth_sign(s / boundary_layer)),
            s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
