#pragma once
#include <algorithm>

#include "terms/term.hpp"

/// What a machine had before a change at one instant, which is estimated with it: -1 before, 0 after. So k1 and e of
/// the model are those of the machine as it is now.
namespace whirl::identification::terms {

struct Step {
  double now = -1, by_instant = 0;

  /// Over a part of a turn, so that the instant has a derivative; what it takes off the blow is below 1 %.
  Step(const TermPoint& p, double instant) {
    constexpr double kTurn = 0.3, kLongest = 0.02;  // rad, s
    const double width = kTurn / std::max(std::abs(p.w), kTurn / kLongest);
    const double u = std::clamp((p.time - instant) / width + 0.5, 0.0, 1.0);
    now = u * u * (3 - 2 * u) - 1;
    by_instant = -6 * u * (1 - u) / width;
  }
};

/// Instants that are tried over a record.
inline constexpr double kInstants = 48;

inline std::string before(const RotorTerm& term) { return fmt::format("(sgn(t - {:.17g}) - 1)/2", term.reference); }

}  // namespace whirl::identification::terms
