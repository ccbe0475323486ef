#pragma once
#include <functional>
#include <string>
#include <vector>

#include "io_file.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/rt/loop_control.hpp"
#include "whirl/rt/loop_sample.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/record_queue.hpp"

namespace whirl::app {

/// How a loop on hardware went.
struct LoopOutcome {
  rt::LoopTiming timing;
  Fault trip = Fault::none;
  long trip_tick = -1;
  std::string reason;                         ///< why it ended
  bool armed = false;                         ///< it ever was
  std::array<rt::InputState, 2> inputs{};     ///< of x and y at the trip, or at the end
  std::vector<std::string> granted, refused;  ///< real-time properties
  std::uint64_t dropped_records = 0;
};

/// One loop on hardware from start to end: settles disarmed, arms, runs in a thread of its own until `seconds`
/// (0: no limit) are over, the rig is done, a signal came, or a tripped loop has been recorded for half a second.
/// `take` gets every cycle, in the calling thread. Without a controller the loop stays disarmed. With `control` a trip
/// does not end the run: somebody may clear it.
LoopOutcome run_loop(const IoSettings& io, rt::HardwareRig& rig, control::Controller* controller, double seconds,
                     const std::function<void(const rt::LoopSample&)>& take,
                     const std::function<void(const LoopOutcome&)>& started = {}, rt::LoopControl* control = nullptr);

}  // namespace whirl::app
