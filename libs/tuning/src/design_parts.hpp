#pragma once
#include "whirl/core/control_types.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// As `assess` where the design is certified; else `certified` is 0 and the rest is left out.
void assess_until_missed(ControllerDesign& design, const DesignOptions& options);

/// Supervision with a level that the run of the model stays far below; `open`: what the rotor does there without
/// control.
void add_supervision(ControllerDesign& design, const DesignOptions& options, const rig::SegmentPeaks& open);
/// The same, the run without control included.
void add_supervision(ControllerDesign& design, const DesignOptions& options);

/// Whether the hammer test or the data sheet has the mode.
bool knows(const Hardware& hardware, const ForcedMode& mode);

/// No certificate where the loop does not hold on a reading of the records that is another kind of force.
void hold_on_readings(const IdentifiedModel& model, const DesignOptions& given, ControllerDesign& best);

}  // namespace whirl::tuning
