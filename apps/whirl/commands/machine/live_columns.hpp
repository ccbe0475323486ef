#pragma once
#include <array>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "whirl/core/quantity.hpp"
#include "whirl/rt/loop_sample.hpp"

namespace whirl::app {

/// What the live view shows of a loop, SI. Lost readings are NaN.
constexpr std::array<std::pair<std::string_view, Quantity>, 17> kLiveColumns{{{"x", Quantity::displacement},
                                                                              {"y", Quantity::displacement},
                                                                              {"beta", Quantity::angle},
                                                                              {"omega", Quantity::angular_velocity},
                                                                              {"ux", Quantity::force},
                                                                              {"uy", Quantity::force},
                                                                              {"s_x", Quantity::velocity},
                                                                              {"s_y", Quantity::velocity},
                                                                              {"x_est", Quantity::displacement},
                                                                              {"y_est", Quantity::displacement},
                                                                              {"vx_est", Quantity::velocity},
                                                                              {"vy_est", Quantity::velocity},
                                                                              {"e_est", Quantity::displacement},
                                                                              {"latency", Quantity::time},
                                                                              {"period", Quantity::time},
                                                                              {"armed", Quantity::dimensionless},
                                                                              {"limited", Quantity::dimensionless}}};
using LiveRow = std::array<double, kLiveColumns.size()>;

/// `previous_start`: LoopSample::started of the cycle before; 0: none. What the controller makes of a sample is 0 while
/// it is disarmed. The eccentricity is that of the unbalance which explains the estimated disturbance d: |d| = e |w^2 -
/// j w'|, shown above 1 rad/s.
inline LiveRow live_row(const rt::LoopSample& s, double previous_start) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const bool valid = (s.flags & rt::kValid) != 0, armed = (s.flags & rt::kArmed) != 0;
  const double unbalance = std::hypot(s.omega * s.omega, s.omega_dot);
  const auto internal = [&](double value) { return armed ? value : 0.0; };
  const double e = armed && std::abs(s.omega) > 1 ? std::hypot(s.dx_est, s.dy_est) / unbalance : 0.0;
  return {valid ? s.x : kNaN,
          valid ? s.y : kNaN,
          s.beta,
          s.omega,
          s.ux,
          s.uy,
          internal(s.s_x),
          internal(s.s_y),
          internal(s.x_est),
          internal(s.y_est),
          internal(s.vx_est),
          internal(s.vy_est),
          e,
          s.started - s.scheduled,
          previous_start > 0 ? s.started - previous_start : 0.0,
          armed ? 1.0 : 0.0,
          (s.flags & (rt::kLimited | rt::kSaturated)) != 0 ? 1.0 : 0.0};
}

}  // namespace whirl::app
