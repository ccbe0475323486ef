#pragma once
#include <algorithm>

#include "whirl/control/laws/axis.hpp"

namespace whirl::control {

/// PD plus integral with clamped integrator: a = -kp x - kd v - i - d, i' = ki x, |i| <= limit.
struct Pid {
  double kp = 0, kd = 60;
  double ki = 1000;  ///< 1/s^3
  double limit = 5;  ///< of the integral part, m/s^2
  double sample_time = 1e-3;
  double integral = 0;  ///< state, m/s^2

  AxisOutput step(const AxisInput& in) noexcept {
    integral = std::clamp(integral + sample_time * ki * in.x, -limit, limit);
    return {-kp * in.x - kd * in.v - integral - in.d, 0};
  }
  void reset() noexcept { integral = 0; }
};

}  // namespace whirl::control
