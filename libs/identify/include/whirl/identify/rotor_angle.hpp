#pragma once
#include <string>

#include "whirl/core/recording.hpp"

namespace whirl::identification {

/// The record with a channel beta (rad) from the once-per-turn pulses of channel `pulses`, replacing one of that name;
/// the angle is 0 at the rising edge of a pulse. Throws Error for a missing channel, samples that are not finite or
/// fewer than 6 pulses.
Recording with_angle_from_pulses(const Recording& record, const std::string& pulses);

}  // namespace whirl::identification
