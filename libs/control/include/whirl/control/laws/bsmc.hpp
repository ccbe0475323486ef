#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

/// Barrier-function gain (Obeid, Fridman, Laghrouche, Harmouche, Automatica 2018): K = K0 |s| / (e - |s|)
/// keeps |s| < e without knowing D_max; capped at gain_max, also for |s| >= e.   a = -f - C v - K(s) sgn s.
struct BarrierSmc {
  double surface_gain = 60;
  double width = 0.1;    ///< e, m/s
  double gain = 1;       ///< K0, m/s^2
  double gain_max = 10;  ///< m/s^2

  AxisOutput step(const AxisInput& in) noexcept {
    const double s = in.v + surface_gain * in.x, margin = width - std::abs(s);
    const double k = margin > 0 ? std::min(gain * std::abs(s) / margin, gain_max) : gain_max;
    return {-(in.f + surface_gain * in.v + k * sgn(s)), s};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
