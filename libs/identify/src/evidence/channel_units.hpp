#pragma once
#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::identification::detail {

/// Fills the unit of every coefficient that has none from the quantities of the record's channels; "s'" is s per
/// second.
void set_coefficient_units(IdentifiedModel& model, const Recording& record);

}  // namespace whirl::identification::detail
