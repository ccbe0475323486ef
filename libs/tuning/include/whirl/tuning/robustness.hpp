#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::tuning {

/// One condition of the robustness matrix and how the design did under it.
struct RobustnessCase {
  std::string name;
  ClosedLoopMetrics metrics;
};

/// The design, unchanged, on rigs that differ from the one it was made for: stiffness +-30 %, damping +-50 %,
/// twice the unbalance, one to three samples of delay it is told and it is not told, structural modes 3 and
/// 15 times as strong, actuators of half and an eighth of the force (told, as their data sheet is), 50 ms
/// without sensor at the critical speed, angle from the speed profile instead of the encoder, five times the speed-loop
/// ripple, ten times the sensor noise, run-up instead of run-down.
std::vector<RobustnessCase> robustness_matrix(const ControllerDesign& design, const rig::RigParameters& rig,
                                              std::uint64_t seed = 1, int threads = 0);

}  // namespace whirl::tuning
