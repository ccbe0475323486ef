#pragma once
#include <filesystem>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::io {
class Json;
}

namespace whirl::tuning {

/// A linear machine that another program modelled, as a rotor and the structure beside it.
struct LinearPlant {
  RotorModel rotor;                     ///< the mode with the largest static compliance; k2 = 0
  std::vector<rig::RigMode> structure;  ///< the other modes, participation and sign relative to the rotor
};

/// True for a document of schema whirl.plant.
bool is_plant(const io::Json& document);

/// Reads whirl.plant/1: displacement at the sensor (m) per force at the actuator (N) of one axis, the other axis alike;
/// `A`, `B`, `C` of x' = A x + B u, z = C x, or `poles` (one of each conjugate pair, rad/s) with `residues` (m/(N s)),
/// complex numbers as [re, im]; `eccentricity_m` and `eccentricity_phase_rad` (0 when left out) of the unbalance.
///
/// Throws Error, with the place in the file, for matrices that do not fit, a direct feedthrough, poles that are real or
/// not stable, modes whose residue is no displacement by a force (its real part above a twentieth), a matrix without
/// a full set of eigenvectors, and where no mode has a positive modal mass.
LinearPlant read_plant(const io::Json& document, const std::filesystem::path& file);

}  // namespace whirl::tuning
