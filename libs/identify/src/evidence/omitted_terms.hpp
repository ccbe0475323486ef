#pragma once
#include "growth/rotor_growth.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification::detail {

/// Widens the intervals of the model and its rotor_covariance by the terms that the search left out although the
/// records do not exclude them, and states each in `ambiguities` where it moves k1, k2 or c by more than the noise
/// does: posterior mean over the models with one more term each (Bayesian model averaging), every coefficient with a
/// normal prior of the size that such a term has on real rotors. Models that the records speak against are left out
/// (Occam's window); one that stands for another parameter (cross-coupled stiffness for damping) costs as much as it
/// may hide. natural_frequency and damping_ratio keep the interval that the records give. `scale`: of the covariances.
void widen_for_omitted(const GrownRotor& grown, double scale, RotorIdentification& result);

/// A term taken up whose coefficient is more than six times what rotors with that term have (the priors of
/// widen_for_omitted) stands for something else: a warning, and no trust.
void judge_sizes(const RotorIdentification& result, Summary& summary);

}  // namespace whirl::identification::detail
