#pragma once
#include <string>
#include <vector>

#include "whirl/hardware/io_settings.hpp"
#include "whirl/hardware/run_loop.hpp"

namespace whirl::hardware {

/// Watches the tacho of `io` for its learning time, the rig disarmed, finds its marks as `signal::angle_of_tacho` does
/// and lets the rig follow them. Returns how the angle was found and what was assumed; nothing without a tacho and
/// when `stop` ended the watch: the rig then follows none. Throws Error in the words of the file for a rotor at rest,
/// pulses too short for the loop's rate, a tacho without a pattern.
std::vector<std::string> learn_tacho(const IoSettings& io, rt::HardwareRig& rig, StopRequest stop = never_stop);

}  // namespace whirl::hardware
