#pragma once
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/deploy/fmu_plant.hpp"

namespace whirl::deploy {

/// A controller with a plant made elsewhere, beside the same plant without control.
struct FmuLoop {
  double open_peak = 0, closed_peak = 0;  ///< radius, m, zero-to-peak, after `settled`
  double settled = 1;                     ///< s; at most half of the run
  double force_peak = 0;                  ///< N, either axis
  Recording closed;                       ///< x, y (m), ux, uy (N), beta (rad), omega (rad/s)
  Summary summary;                        ///< unusable when the FMU refused a step or the loop tripped

  double suppression() const { return 1 - closed_peak / open_peak; }
};

/// Runs the FMU twice along the speed profile of `plant`, without and with the controller. Throws Error for an FMU that
/// cannot be loaded or lacks a variable.
FmuLoop run_fmu(const ControllerDesign& design, const std::string& fmu, const FmuPlantOptions& plant);

}  // namespace whirl::deploy
