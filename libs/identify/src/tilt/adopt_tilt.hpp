#pragma once
#include <vector>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"

namespace whirl::identification::detail {

/// `identify_rotor_detailed`, and where one record leaves something unexplained, or needs a mode that no hammer test
/// showed, a rotor that tilts in its place when that explains the record clearly better. `model` alone is that rotor's
/// then.
RotorIdentification rotor_or_tilt(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options);

/// Warnings and trust of a rotor that tilts; `peak`: of the record, m.
void judge_tilt(const RotorRecord& record, double peak, IdentifiedModel& model);

/// A rotor that tilts from another record, begun at `like`; unusable where the record does not give one.
IdentifiedModel tilt_of(const Recording& recording, const IdentifiedModel& like, const RotorIdentifyOptions& options);

}  // namespace whirl::identification::detail
