#pragma once
#include "whirl/control/laws/axis.hpp"

namespace whirl::control {

/// Proportional plus derivative with disturbance feedforward: a = -kp x - kd v - d. No model of the stiffness
/// is used; negative kp means that stiffness is taken away.
struct Pd {
  double kp = 0;   ///< 1/s^2
  double kd = 60;  ///< 1/s

  AxisOutput step(const AxisInput& in) noexcept { return {-kp * in.x - kd * in.v - in.d, 0}; }
  void reset() noexcept {}
};

}  // namespace whirl::control
