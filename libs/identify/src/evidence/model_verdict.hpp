#pragma once
#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// The verdict on a model by its own summary and all evidence; sets `summary` and model.summary.
/// A rotor whose part gives other parameters than the whole, beyond four deviations, does not follow one model: warns,
/// withdraws the trust and widens the intervals to cover both.
void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model);
void judge_evidence(Identification& identification);

}  // namespace whirl::identification::detail
