#pragma once
#include <cstdint>
#include <functional>
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/hardware/run_loop.hpp"
#include "whirl/io/json.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::hardware {

struct VirtualRunOptions {
  std::uint64_t seed = 1;                           ///< of the sensor noise
  bool repeat = false;                              ///< begin the profile again at its end, with the next seed
  std::function<void(const rt::LoopSample&)> take;  ///< every cycle, in the calling thread
  rt::LoopControl* control = nullptr;               ///< of a person who may arm, disarm and clear a trip
  StopRequest stop = never_stop;
};

struct VirtualRun {
  rt::LoopTiming timing;
  std::uint64_t dropped_records = 0;
  std::string reason;  ///< why it ended
};

/// The closed loop on the virtual rig in real time. The time of the rig is counted in ticks: a late machine makes the
/// rig late, never wrong.
VirtualRun run_virtual(const ControllerDesign& design, const rig::RigParameters& rig, const VirtualRunOptions& options);
/// What the sensors of that rig show without control: x, y (m), beta (rad).
Recording virtual_open_loop(const rig::RigParameters& rig, std::uint64_t seed);
/// whirl.live/1
io::Json to_json(const VirtualRun& run);

}  // namespace whirl::hardware
