#pragma once
#include <functional>
#include <string>
#include <vector>

#include "whirl/control/controller.hpp"
#include "whirl/hardware/io_settings.hpp"
#include "whirl/rt/loop_control.hpp"
#include "whirl/rt/loop_sample.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/record_queue.hpp"

namespace whirl::hardware {

/// How a loop on hardware went.
struct LoopOutcome {
  rt::LoopTiming timing;
  Fault trip = Fault::none;
  long trip_tick = -1;
  std::string reason;                         ///< why it ended
  bool armed = false;                         ///< it ever was
  bool cut_short = false;                     ///< without a controller: the board fell silent or was lost
  std::array<rt::InputState, 2> inputs{};     ///< of x and y at the trip, or at the end
  std::vector<std::string> granted, refused;  ///< real-time properties
  std::uint64_t dropped_records = 0;
};

/// Asked in every cycle by the thread of the loop: is the end wanted? A plain function, such as one that reads a flag
/// set by a signal.
using StopRequest = bool (*)() noexcept;
inline bool never_stop() noexcept { return false; }

struct LoopRunOptions {
  double seconds = 0;                                    ///< after arming; 0: no limit
  std::function<void(const rt::LoopSample&)> take = {};  ///< gets every cycle, in the calling thread
  std::function<void(const LoopOutcome&)> started = {};  ///< once, when the real-time properties are known
  rt::LoopControl* control = nullptr;                    ///< with it a trip does not end the run: somebody may clear it
  StopRequest stop = never_stop;
  /// s, beside the watchdog's time, in which a silent board is waited for: at the start, and without a controller.
  double patience = 5;
};

/// One loop on hardware from start to end: settles disarmed, arms, runs in a thread of its own until the time is over,
/// the rig is done, `stop` asks for the end, or a tripped loop has been recorded for half a second. Without a
/// controller the loop stays disarmed.
LoopOutcome run_loop(const IoSettings& io, rt::HardwareRig& rig, control::Controller* controller,
                     const LoopRunOptions& options);

}  // namespace whirl::hardware
