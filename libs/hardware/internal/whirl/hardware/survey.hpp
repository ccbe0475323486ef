#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <string>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/hardware/io_settings.hpp"
#include "whirl/hardware/run_loop.hpp"
#include "whirl/io/json.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/loop_delay.hpp"

namespace whirl::hardware {

/// What one displacement channel showed, disarmed.
struct ChannelSurvey {
  long ticks = 0;
  std::array<long, rt::kInputStates> states{};                   ///< ticks in each InputState
  std::array<long, rt::optoncdt::kSensorErrors> errors{};        ///< of these, the error codes of the laser
  double mean = 0, low = 0, high = 0;                            ///< distance, m
  double noise = 0;                                              ///< rms, m: second differences, blind to slow motion
  long longest_repeat = 0;                                       ///< ticks in a row with the very same value
  std::uint64_t frames = 0, frames_lost = 0, bytes_dropped = 0;  ///< laser only
  double rate = 0;                                               ///< of the laser, Hz; lost frames counted

  double share(rt::InputState s) const {
    return ticks > 0 ? static_cast<double>(states[static_cast<std::size_t>(s)]) / static_cast<double>(ticks) : 0;
  }
};

struct LoopSurvey {
  std::array<ChannelSurvey, 2> channel;
  double seconds = 0;              ///< of the disarmed part
  double board_rate = 0;           ///< ticks per second of this machine's clock, Hz; 0: the board has no clock
  long missed = 0;                 ///< ticks that the loop left out
  std::vector<std::string> angle;  ///< with a tacho: how the angle was found and what was assumed
  double beta_first = 0, beta_last = 0, omega = 0;  ///< angle, and speed as the board reports it; rad, rad/s
  std::array<double, 4> analog{};                   ///< mean of the inputs, V
  /// Ticks from a reading to the reading that says the command answering it has come; by the board.
  double turnaround_mean = 0;
  long turnaround_max = 0, turnarounds = 0;
  std::array<rt::LoopDelay, 2> delay;  ///< with excitation; explained = 0 without
  Fault trip = Fault::none;            ///< of the excitation
  double excitation = 0;               ///< N; 0: none
  Summary summary;                     ///< unusable when a channel is not fit for control, with every reason
};

/// Once; the rig outlives what is done with it.
using OpenRig = std::function<rt::HardwareRig&()>;

/// Runs the loop without a controller for `seconds`; then, with `excitation` > 0, a random telegraph force of so many
/// newton on x, then on y, for `seconds` each, on the shaft at rest.
LoopSurvey survey(const IoSettings& io, double seconds, double excitation, StopRequest stop = never_stop);
/// The same on a rig that `open` opens when everything else is ready.
LoopSurvey survey(const IoSettings& io, const OpenRig& open, double seconds, double excitation,
                  StopRequest stop = never_stop);

/// whirl.io-test/1
io::Json to_json(const IoSettings& io, const LoopSurvey& survey);

}  // namespace whirl::hardware
