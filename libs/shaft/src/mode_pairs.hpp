#pragma once
#include <vector>

#include "eigenpairs.hpp"
#include "whirl/shaft/modes.hpp"

namespace whirl::shaft {

/// Frequency, by that of the first mode that bends, below which the answer for a free motion of rigid parts is
/// rounding.
constexpr double kRigid = 1e-3;

/// The `count` eigenpairs of smallest |pole| at a speed, of the circular equations where the supports allow them. Not
/// those of the motions of rigid parts that no support holds.
std::vector<Eigenpair> pairs_at(const System& system, double speed, int count);
/// Circular or plane by the length of its shape.
Mode mode_of(const System& system, const Eigenpair& pair);

}  // namespace whirl::shaft
