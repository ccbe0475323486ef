#pragma once
#include <vector>

#include "whirl/rig/parameters.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rotor/lateral_step.hpp"

namespace whirl {

/// Exact propagation of one mode over part of a tick from (q, q', f, c): f the lagged force at the start of the tick,
/// c the force it tends to, N.
struct ModeMap {
  double q_q, q_dq, q_f, q_c;      ///< q at the end
  double dq_q, dq_dq, dq_f, dq_c;  ///< q' at the end
};

/// All of a rig that does not depend on the command or the noise.
class RigTables {
 public:
  explicit RigTables(const RigParameters& parameters);

  RigParameters parameters;
  long ticks = 0;              ///< control ticks of the profile
  double step = 0;             ///< Runge-Kutta step, s
  LateralCoefficients<double> coefficients{};
  double gain = 0;             ///< 1/m, 1/kg
  double lag_half_step = 0;    ///< exp(-step / (2 tau)); 0 without lag
  LateralState<double> start{};
  std::vector<LateralInput<double>> forcing;  ///< eps F at every half step, m/s^2
  std::vector<long> sensor_step;              ///< per tick: step whose end is the sensor instant read there
  std::vector<LateralInput<double>> runout;   ///< per tick: surface error at that instant, m
  std::vector<AngleState> measured_angle;     ///< per tick
  std::vector<AngleState> true_angle;         ///< per tick
  std::vector<std::vector<ModeMap>> mode_maps;  ///< [steps 1 .. substeps since the tick][mode]

  double sensor_lsb = 0, volt_lsb = 0;  ///< 0 without converter
};

}  // namespace whirl
