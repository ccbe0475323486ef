#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::identification {

/// The rotor with another unbalance, `by` times the one it has (turned by its angle): eps, and the further modes, which
/// the same unbalance forces.
void scale_unbalance(RotorModel& rotor, std::complex<double> by);

/// The model as an alternative of its ambiguities reads the records: its parameters, and what of `rotor` they are (k1,
/// k2, c, e, e_phase, k1_conj, c_conj, shares of further modes). A parameter that the alternative adds takes the place
/// in the covariance of the one that it sets to zero; otherwise it is independent. `equations` stay as they are;
/// `ambiguities` is empty.
IdentifiedModel as_read(const IdentifiedModel& model, const Alternative& alternative);

/// One reading beside the model's own.
struct ModelReading {
  std::string reading;
  double odds = 0;
  IdentifiedModel model;
};
/// Those that no interval of the model covers (Ambiguity::covered false); with `covered` those it covers as well.
std::vector<ModelReading> other_readings(const IdentifiedModel& model, bool covered = false);

}  // namespace whirl::identification
