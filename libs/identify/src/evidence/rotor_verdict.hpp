#pragma once
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification::detail {

/// Status, warnings, residual and trust sentence of an identified rotor, from its own numbers and records.
void judge_rotor(const std::vector<RotorRecord>& records, const RotorIdentification& result, Summary& summary);

}  // namespace whirl::identification::detail
