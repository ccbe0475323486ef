#pragma once
#include <filesystem>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/deploy/fmu_plant.hpp"

namespace whirl::deploy {

/// What a laboratory would find out about a plant made elsewhere.
struct FmuSurvey {
  IdentifiedModel model;  ///< of the run without force (identify_rotor), with the gain of the pull test
  Recording run;          ///< x, y (m), beta, omega, omega_dot along the profile, no force
  Recording blow;         ///< one blow along x at standstill: force (N), x (m)
};

/// Measures an FMU as a machine: a run along the profile without force; a constant force at standstill that bends it by
/// a fifth of its eccentricity (gain = (k1 x + k2 x^3) / F, the mean of x under a Hann window of 8 s); a blow of one
/// sample at standstill. The FMU is loaded anew for each. `noise` (m rms, white) is added to the displacements of the
/// run: without it every error of the integration is a force of the machine. Throws Error for an FMU that cannot be
/// loaded, lacks a variable, refuses a step, does not follow the force or is no rotor to identify_rotor.
FmuSurvey survey_fmu(const std::filesystem::path& fmu, const FmuPlantOptions& options, double noise = 1e-6);

}  // namespace whirl::deploy
