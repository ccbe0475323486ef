#pragma once
#include <functional>

#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// The verdict on a model by its own summary and all evidence; sets `summary` and model.summary.
/// A rotor whose part gives other parameters than the whole, beyond four deviations, does not follow one model: warns,
/// withdraws the trust and widens the intervals to cover both.
void compare_with_rest(const IdentifiedModel& rest, IdentifiedModel& model);

/// Whether two models have parameters of the same names and the same resonance for that of k1.
bool same_parts(const IdentifiedModel& a, const IdentifiedModel& b);

/// The resonances of a rotor that all its records pass and the rest, without the part held out, does not: what a model
/// of the rest says there is no evidence for or against the model. One finding each; `held`: the part.
/// rest.amplitude: infinite where it does not compare with that of all (another unbalance). `rate`: how fast the
/// records pass a speed (rad/s, rad/s^2): the faster, the farther beyond a resonance its motion comes.
std::vector<Finding> not_shown_by_rest(const IdentifiedModel& model, const DataRange& all, const DataRange& rest,
                                       const std::function<double(double)>& rate, const std::string& held);
/// Fastest change of the speed where records pass the speed `omega`, rad/s^2; 0 where none does.
double passing_rate(const std::vector<Recording>& records, double omega);
void judge_evidence(Identification& identification);

}  // namespace whirl::identification::detail
