#pragma once
#include "growth/rotor_growth.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification::detail {

/// Unbalance of a fit with a bow such that rotor and runout, without the force of the bow, move alike at the critical
/// speed: eps - i c / omega b.
void read_as_runout(OutputErrorFit& fit);

/// What the records cannot tell apart, stated in `ambiguities` and carried on: the intervals of the model and its
/// rotor_covariance are widened to cover every reading. Readings that the search found make the summary warn.
/// `scale`: of the covariances.
void carry_ambiguities(const GrownRotor& grown, double scale, RotorIdentification& result);

/// A model of another kind that explains the records as well: the intervals of k1, k2, c and e hold both.
void hold_other_kind(IdentifiedModel& model, const IdentifiedModel& other, std::string readings, Decider decider);

/// Without a measured angle the phase of e is any; intervals, covariance and assumptions say so.
void forget_phase(RotorIdentification& result);
/// The phase of e is known to half a step of the angle readings: a counter that rounds down reads half a step less than
/// one that rounds to the nearest.
void state_angle_step(const std::vector<RotorRecord>& records, RotorIdentification& result);
/// What records of one axis leave open, as a reading beside the isotropic rotor and as assumptions of the model.
void state_one_axis(const std::vector<RotorRecord>& records, RotorIdentification& result);
/// How much of the readings the modes above the speeds are, and that the rotor is the first mode.
void state_modes_above(RotorIdentification& result);

}  // namespace whirl::identification::detail
