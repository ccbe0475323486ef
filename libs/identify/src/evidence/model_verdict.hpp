#pragma once
#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// The verdict on a model by its own summary and all evidence; sets `summary` and model.summary.
/// A rotor whose part gives other parameters than the whole, beyond four deviations, does not follow one model: warns,
/// withdraws the trust and widens the intervals to cover both.
void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model);

/// The resonances of a rotor that all its records pass and the rest, without the part held out, does not: what a model
/// of the rest says there is no evidence for or against the model. One finding each; `held`: the part.
/// rest.amplitude: infinite where it does not compare with that of all (another unbalance).
std::vector<Finding> not_shown_by_rest(const IdentifiedModel& model, const DataRange& all, const DataRange& rest,
                                       const std::string& held);
void judge_evidence(Identification& identification);

}  // namespace whirl::identification::detail
