#pragma once
#include "whirl/rig/parameters.hpp"
#include "whirl/rotor/gyroscopic.hpp"

namespace whirl::rig {

/// The rig's rotor with its tilt, isotropic part: whirl frequencies over speed (whirl_poles), critical speeds,
/// unbalance response. Throws Error when the rig has no tilt.
rotor::GyroscopicRotor gyroscopic_rotor(const RigParameters& parameters);

}  // namespace whirl::rig
