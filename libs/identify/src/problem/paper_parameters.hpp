#pragma once
#include "whirl/core/identified_model.hpp"

namespace whirl::identification::detail {

/// Adds k1, k2, c, e, e_phase, per axis and averaged, read from the terms of X2' and X4' (paper eqs. 23, 24).
void add_rotor_parameters(IdentifiedModel& model);

}  // namespace whirl::identification::detail
