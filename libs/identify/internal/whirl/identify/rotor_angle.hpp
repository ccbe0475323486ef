#pragma once
#include <string>

#include "whirl/core/recording.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/signal/tacho_pattern.hpp"

namespace whirl::identification {

/// The record with a channel beta (rad) from the pulses or the speed of channel `pulses` (signal::with_tacho_angle),
/// replacing one of that name. `pulses` empty: a record that has beta stays as it is, else its channel key, keyphasor,
/// tacho, speed, rpm or omega is taken, if it has one. How the angle was found, and pulses that were missing or extra,
/// are remarks.
Recording with_angle_from_pulses(const Recording& record, const std::string& pulses,
                                 const signal::TachoOptions& tacho = {});

/// Where no channel is called x or y: the record with its velocities or accelerations of the two directions so called,
/// by the letter in their names (ax and ay, vx, acc_y, vel x); a single such channel is x whatever its name. A remark
/// says which. A record with a displacement stays as it is. Throws Error where a direction has several such channels.
Recording with_motion_names(Recording record);

/// The record with an angle that its own vibration at one times the speed shows, for records without a tacho: the
/// frequency of the largest line, stretch by stretch, is followed by a polynomial; then the phase behind it, less the
/// lag of a rotor that passes its critical speed. A first guess, good to about a radian: AngleSource::vibration refines
/// it with the rotor. Its zero is arbitrary. `degree`: of the polynomial in time that the angle follows, 2 to 5. Throws
/// Error for a record without displacement or with fewer than 768 samples.
Recording with_angle_from_vibration(const Recording& record, const RotorRecordOptions& names, int& degree);

}  // namespace whirl::identification
