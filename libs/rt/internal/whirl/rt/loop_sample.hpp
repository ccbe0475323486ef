#pragma once
#include <cstdint>
#include <type_traits>

namespace whirl::rt {

/// One cycle as it is recorded: what came, what the controller made of it, what was sent. SI.
struct LoopSample {
  std::int64_t tick = -1;
  double t = 0;          ///< time of the tick, s
  double scheduled = 0;  ///< instant of the grid (sample-driven: of the arrival), s of the machine's monotonic clock
  double started = 0;    ///< start of the cycle, s of the same clock
  double x = 0, y = 0, beta = 0, omega = 0, omega_dot = 0;
  double x_est = 0, y_est = 0, vx_est = 0, vy_est = 0, dx_est = 0, dy_est = 0;  ///< estimate; d: disturbance, m/s^2
  double s_x = 0, s_y = 0;                                                      ///< sliding variables
  double ux_requested = 0, uy_requested = 0;                                    ///< before every limit, N
  double ux = 0, uy = 0;                                                        ///< sent, N
  std::int32_t flags = 0;                                                       ///< LoopFlag
  std::int32_t trip = 0;                                                        ///< Fault
  std::int32_t missed = 0;                                                      ///< ticks left out before this one
};
static_assert(std::is_trivially_copyable_v<LoopSample>);

enum LoopFlag : std::int32_t { kValid = 1, kArmed = 2, kLimited = 4, kSaturated = 8, kHeld = 16, kReleasing = 32 };
/// From this bit of the flags on: the status word of the supervision (whirl/control/supervisor.hpp).
inline constexpr int kSupervisionShift = 8;

}  // namespace whirl::rt
