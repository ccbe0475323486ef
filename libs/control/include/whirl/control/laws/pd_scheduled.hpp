#pragma once
#include "whirl/control/laws/axis.hpp"
#include "whirl/control/laws/speed_table.hpp"

namespace whirl::control {

/// PD control whose gains follow the speed: a = -kp(|omega|) x - kd(|omega|) v - d.
struct ScheduledPd {
  static constexpr std::size_t kNodes = 4;
  SpeedTable<kNodes, 2> gains;  ///< kp 1/s^2, kd 1/s

  AxisOutput step(const AxisInput& in) noexcept {
    const auto [kp, kd] = gains.at(in.omega);
    return {-kp * in.x - kd * in.v - in.d, 0};
  }
  void reset() noexcept {}
};

}  // namespace whirl::control
