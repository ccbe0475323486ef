#pragma once
#include <vector>

namespace whirl::signal::detail {

/// Once-per-turn pulses with the turn that each one ends.
struct CountedPulses {
  std::vector<double> times;  ///< s, ascending
  std::vector<double> turns;  ///< 0 at the first of them
  long missing = 0, extra = 0;
};

/// Counts turns outwards from the longest stretch of even pulses. Throws Error where there is none.
CountedPulses count_turns(const std::vector<double>& times);

}  // namespace whirl::signal::detail
