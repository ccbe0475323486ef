#pragma once
#include "whirl/core/modal_model.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// Rig whose linear structure is a measured modal model: `base` with mass, stiffness and damping of the
/// rotor, and its extra modes, taken from one drive-point channel (force and response at the disk, same
/// direction).
///
/// Receptance residue of a real mode a = 1 / (2 i m w_d) (paper eq. 20): modal mass m = -1 / (2 w_d Im a).
/// The mode with the largest static compliance 1 / (m w^2) is the rotor; the others are driven and seen at
/// the disk with participation m_rotor / m_mode. Anisotropy, cubic stiffness, unbalance and sensors stay
/// those of `base`: a drive point does not show them. A close partner of the rotor's mode (the other axis,
/// within 5 %) is left out, because `base` has both axes already.
///
/// Throws Error when the channel does not exist or no mode has a positive modal mass.
RigParameters rig_from_modal(const ModalModel& modal, Eigen::Index channel = 0, const RigParameters& base = {});

}  // namespace whirl::rig
