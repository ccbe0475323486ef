#pragma once
#include <complex>
#include <vector>

#include "whirl/rig/parameters.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rotor/tilted_step.hpp"

namespace whirl::rig {

/// Exact propagation of one mode over part of a tick from (q, q', f, c): f the lagged force at the start of
/// the tick, c the force it tends to, N.
struct ModeMap {
  double q_q, q_dq, q_f, q_c;      ///< q at the end
  double dq_q, dq_dq, dq_f, dq_c;  ///< q' at the end
};

/// Zero for a rotor without tilt: the deflection alone then moves.
rotor::TiltCoefficients tilt_coefficients(const RigParameters& parameters);

/// The part that depends on profile, laser rate and latency, encoder and timing only.
struct AngleTables {
  explicit AngleTables(const RigParameters& parameters);

  long ticks = 0;                                    ///< control ticks of the profile
  double step = 0;                                   ///< Runge-Kutta step, s
  std::vector<rotor::LateralInput<double>> forcing;  ///< F = e^{i beta} (beta'^2 - i beta'') at every half step, 1/s^2
  std::vector<double> omega;                         ///< speed at every half step, rad/s
  std::vector<long> sensor_step;                     ///< per tick: step whose end is the sensor instant read there
  std::vector<std::complex<double>> sensor_turn;     ///< per tick: e^{i beta} at that instant
  std::vector<rotor::AngleState> measured_angle;     ///< per tick
  std::vector<rotor::AngleState> true_angle;         ///< per tick
};

/// All of a rig that does not depend on the command or the noise.
class RigTables {
 public:
  RigTables(const RigParameters& parameters, const RigTables* like);

  RigParameters parameters;
  std::shared_ptr<const AngleTables> angle;
  rotor::LateralCoefficients<double> coefficients{};
  rotor::FurtherForces<double> forces{};
  bool further = false, dry = false;  ///< any of them; friction or quadratic damping
  double eps_re = 0, eps_im = 0;      ///< eccentricity, m
  double gain = 0;                    ///< 1/m, 1/kg
  double lag_half_step = 0;           ///< exp(-step / (2 tau)); 0 without lag
  rotor::TiltedState start;
  rotor::TiltCoefficients tilt;
  std::vector<rotor::LateralInput<double>>
      not_disk;  ///< per tick: runout and modes driven by the unbalance at the instant, m
  std::vector<std::vector<ModeMap>> mode_maps;  ///< [steps 1 .. substeps since the tick][mode]

  double sensor_lsb = 0, volt_lsb = 0;  ///< 0 without converter
};

}  // namespace whirl::rig
