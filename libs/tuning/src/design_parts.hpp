#pragma once
#include "whirl/core/control_types.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// Whether the hammer test or the data sheet has the mode.
bool knows(const Hardware& hardware, const ForcedMode& mode);

/// No certificate where the loop does not hold on a reading of the records that is another kind of force.
void hold_on_readings(const IdentifiedModel& model, const DesignOptions& given, ControllerDesign& best);

}  // namespace whirl::tuning
