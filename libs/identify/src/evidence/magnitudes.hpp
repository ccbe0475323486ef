#pragma once
#include "whirl/core/identified_model.hpp"

namespace whirl::identification::detail {

/// Intervals of the parameters that are sizes of vectors ("e" beside "e_phase"): never below zero, and near it by the
/// law of a size (core/magnitude.hpp). Where zero is within, any phase is.
void keep_magnitudes(IdentifiedModel& model);

}  // namespace whirl::identification::detail
