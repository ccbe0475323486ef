#pragma once
#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {

/// F(d) = f0 + K1 (d - d0) + K2 (d - d0)^3 (paper eq. 12), from a force-deflection table.
struct StiffnessLaw {
  Estimate k1;               ///< N/m
  Estimate k2;               ///< N/m^3
  Estimate offset;           ///< deflection d0 at zero force, m
  double cubic_p_value = 1;  ///< probability of a cubic term this large if there were none (t test)
  double hysteresis = 0;     ///< largest loading/unloading difference, N; 0 when the table has one direction only
  long points = 0;
  Summary summary;
  Provenance provenance;
};

}  // namespace whirl
