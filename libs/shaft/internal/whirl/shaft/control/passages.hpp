#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "whirl/shaft/control/controller.hpp"
#include "whirl/shaft/system.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::shaft {

/// The controller on the rotor of `system`, for RunOptions::control. Probes and actuators are found by their names.
/// Throws Error where the rotor lacks one. The readings have white noise of this rms, m.
SampledForces sampled_forces(const Rotor& rotor, const System& system, const RotorController& controller,
                             double noise = 0, std::uint64_t seed = 1);

/// A critical speed and what happens around it: from half way to the one before, to half way to the next, at most a
/// quarter of it.
struct ControlledPassage {
  double speed = 0, from = 0, to = 0;  ///< rad/s
  double open = 0, closed = 0;         ///< largest deflection at any of the nodes looked at, m; open NaN: no such run
  Eigen::VectorXd force;               ///< largest, N, by actuator
};
/// At the forward critical speeds without control that the run passes. Bias stiffness of magnets counts as control.
/// `open` may be null: unstable without control.
std::vector<ControlledPassage> passages(const System& system, const RotorRun* open, const RotorRun& closed,
                                        const std::vector<Eigen::Index>& nodes);

}  // namespace whirl::shaft
