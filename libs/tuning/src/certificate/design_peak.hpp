#pragma once
#include <algorithm>

#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// Peak of the machines that the model and the data sheets allow: draws them as `robustness` does and states
/// typical_peak_m and peak_m in the margins of a certified design (see `design`). Takes the certificate back where the
/// drawn machines show that more than 5 % fail the judge.
void bound_peak(ControllerDesign& design, const IdentifiedModel& model, const DesignOptions& options);

/// Displacement at which a run is lost, m: half of the open-loop peak, at least four times the closed one, at most 90
/// %.
inline double trip_displacement(double open, double closed) {
  return std::min(std::max(0.5 * open, 4 * closed), 0.9 * open);
}

}  // namespace whirl::tuning
