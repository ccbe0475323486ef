#pragma once
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/sindy/identify_rotor.hpp"

namespace whirl::detail {

/// Residual beyond the noise over the motion of the main mode, both rms.
double unexplained_share(const std::vector<RotorRecord>& records, const OutputErrorFit& fit);

/// Status, warnings, residual and trust sentence of an identified rotor, from its own numbers and records.
void judge_rotor(const std::vector<RotorRecord>& records, const RotorIdentification& result, Summary& summary);

}  // namespace whirl::detail
