#pragma once
#include <string>

#include "whirl/core/recording.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification {

/// The record with a channel beta (rad) from the once-per-turn pulses of channel `pulses`, replacing one of that name;
/// the angle is 0 at the rising edge of a pulse. `pulses` empty: a record that has beta stays as it is, else its
/// channel key, keyphasor or tacho is taken, if it has one, with a remark. Pulses that were missing or extra are a
/// remark too. Throws Error for a missing channel, samples that are not finite or fewer than 6 pulses.
Recording with_angle_from_pulses(const Recording& record, const std::string& pulses);

/// The record with an angle that its own vibration at one times the speed shows, for records without a tacho: the
/// frequency of the largest line, stretch by stretch, is followed by a polynomial; then the phase behind it, less the
/// lag of a rotor that passes its critical speed. A first guess, good to about a radian: AngleSource::vibration refines
/// it with the rotor. Its zero is arbitrary. `degree`: of the polynomial in time that the angle follows, 2 to 5. Throws
/// Error for a record without displacement or with fewer than 768 samples.
Recording with_angle_from_vibration(const Recording& record, const RotorRecordOptions& names, int& degree);

}  // namespace whirl::identification
