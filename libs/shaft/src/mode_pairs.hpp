#pragma once
#include <vector>

#include "eigenpairs.hpp"
#include "whirl/shaft/modes.hpp"

namespace whirl::shaft {

/// The `count` eigenpairs of smallest |pole| at a speed, of the circular equations where the supports allow them.
std::vector<Eigenpair> pairs_at(const System& system, double speed, int count);
/// Circular or plane by the length of its shape.
Mode mode_of(const System& system, const Eigenpair& pair);

}  // namespace whirl::shaft
