#pragma once
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "whirl/core/quantity.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/rt/loop_sample.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::monitor {

/// What the live view shows of a loop, SI. Lost readings are NaN.
constexpr std::array<std::pair<std::string_view, Quantity>, 17> kLoopColumns{{{"x", Quantity::displacement},
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
using LoopRow = std::array<double, kLoopColumns.size()>;

/// `previous_start`: LoopSample::started of the cycle before; 0: none. What the controller makes of a sample is 0 while
/// it is disarmed. The eccentricity is that of the unbalance which explains the estimated disturbance d: |d| = e |w^2 -
/// j w'|, shown above 1 rad/s.
LoopRow loop_row(const rt::LoopSample& s, double previous_start);

/// A recording of a loop with these columns; ticks left out are gaps. `file`: for messages. Throws Error for fewer than
/// two cycles and for ticks that do not ascend.
Recording loop_recording(const rt::LoopRecord& record, const std::string& file);

}  // namespace whirl::monitor
