#pragma once
#include "growth/rotor_growth.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification::detail {

/// Widens the intervals of the model and its rotor_covariance by the terms that the search left out although the
/// records do not exclude them: posterior mean over the models with one more term each (Bayesian model averaging),
/// every coefficient with a normal prior of the size that such a term has on real rotors. A term that the records
/// determine well, and that is not there, costs nothing; one that stands for another (cross-coupled stiffness for
/// damping) costs as much as it may hide. `scale`: of the covariances.
void widen_for_omitted(const GrownRotor& grown, double scale, RotorIdentification& result);

/// A term taken up whose coefficient is more than six times what rotors with that term have (the priors of
/// widen_for_omitted) stands for something else: a warning, and no trust.
void judge_sizes(const RotorIdentification& result, Summary& summary);

}  // namespace whirl::identification::detail
