#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "whirl/tuning/closed_loop.hpp"

namespace whirl::tuning {

/// One condition that the design was not made for, run as designed and with supervision.
struct OffNominalCase {
  std::string name;
  double change = 0;          ///< time at which the machine changes, s; 0: from the start
  bool acts = true;           ///< something is to be found: the condition is beyond the tolerances
  ClosedLoopMetrics without;  ///< supervision off
  ClosedLoopMetrics with;     ///< supervision on
  double worst_without = 0;   ///< largest closed / open peak of a segment, where the open one is above 50 um
  double worst_with = 0;      ///< the same with supervision
  double detected = -1;       ///< first bit of the status word, s after the change; negative: none
  std::uint32_t word = 0;     ///< every bit of the status word that stood
};

/// Runs a design on 18 machines it was not made for: balanced, half, twice and turned unbalance (turned in mid-run
/// too); actuator gain -30 to +30 %; one to three samples of delay more; structural modes of the other sign and three
/// times as strong; stiffness -30 and +30 %; sensor lost for 50 ms and for good; encoder slipped by 90 degrees. Peaks
/// leave out the first 0.3 s, and are compared with the same machine without control.
std::vector<OffNominalCase> off_nominal(const ControllerDesign& design, const rig::RigParameters& rig,
                                        std::uint64_t seed = 1, int threads = 0);

}  // namespace whirl::tuning
