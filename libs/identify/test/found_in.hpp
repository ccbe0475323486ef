#pragma once
#include <cmath>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/slow_roll.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::identification {

/// What is found in the record of a machine drawn by `seed`, at that signal-to-noise ratio (dB).
inline RotorIdentification found_in(testing::Oddity oddity, unsigned seed, double snr) {
  return identify_rotor_detailed(
      {rotor_record(testing::machine_record(testing::draw_machine(oddity, seed), snr, seed))});
}

/// Error beyond four stated deviations and the share given.
inline bool wrong(const IdentifiedModel& model, const char* name, double truth, double share) {
  const Estimate& e = *model.parameter(name);
  const double error = std::abs(e.value - truth);
  return error > 4 * e.sd && error > share * std::abs(truth);
}

}  // namespace whirl::identification
