#pragma once
#include <optional>
#include <vector>

#include "whirl/identify/weak_rotor.hpp"

namespace whirl::identification::detail {

/// Where the vibration has two peaks over speed: the weak equations of the lower one alone, from the samples below the
/// valley between them. The equations of all samples know one resonance and may take the upper one for it; what is
/// nonlinear belongs to the lower. Nothing where there is one peak, or where a record has no rows below the valley.
std::optional<WeakRotorFit> lower_resonance(const std::vector<RotorRecord>& records, const WeakRotorOptions& weak);

}  // namespace whirl::identification::detail
