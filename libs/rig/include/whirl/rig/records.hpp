#pragma once
#include <optional>

#include "whirl/core/recording.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::rig {

/// A record of the rig without control and, apart from it, the truth.
struct OpenLoopRecord {
  Recording measured;  ///< x, y (m) by the lasers, beta (rad) by the encoder
  Recording truth;     ///< x, y, dx, dy of the disk centre, beta, omega, alpha
};

/// Runs the rig with zero command over its whole profile. With `snr_db` the laser noise is replaced by white
/// noise of sd = sd(clean reading of that axis) 10^(-snr/20). Unbalance cases: set rotor.added_mass (0, 2.5
/// g, 5 g) before.
OpenLoopRecord record_open_loop(const RigParameters& parameters, const RigRun& run = {},
                                std::optional<double> snr_db = {});

/// Force gauge and dial indicator of paper section III-B.
struct StiffnessTestOptions {
  double direction = 0;                  ///< of force and deflection, rad from x
  double max_deflection = 6e-3;          ///< m
  int points = 25;                       ///< per direction of loading
  bool unloading = true;                 ///< measure back to zero as well
  double force_resolution = 0.0445;      ///< digital force gauge, N (0.01 lbf)
  double force_noise = 0.05;             ///< repeatability, N rms
  double deflection_resolution = 10e-6;  ///< dial indicator graduation, m
  double zero_offset = 15e-6;            ///< dial not exactly at zero, m
  std::uint64_t seed = 1;
};
struct StiffnessTable {
  Eigen::VectorXd deflection;  ///< m
  Eigen::VectorXd force;       ///< N
};
StiffnessTable simulate_stiffness_test(const RigParameters& parameters, const StiffnessTestOptions& options = {});

/// Instrumented hammer and accelerometers of paper section IV-B on the rotor at rest.
struct HammerTestOptions {
  int blows = 5;
  double rate = 2048;                                  ///< Hz
  double duration = 8;                                 ///< of one record, s
  double pretrigger = 0.05;                            ///< s before the blow
  double force_min = 40, force_max = 150;              ///< peak force of the blows, uniform, N
  double pulse_min = 2.5e-3, pulse_max = 3.5e-3;       ///< length of the half sine, s
  double hammer_range = 222.4;                         ///< 50 lbf, N
  double hammer_volt_per_newton = 0.1 / 4.4482216;     ///< 100 mV/lbf
  double accelerometer_volt_per_ms2 = 0.05 / 9.80665;  ///< 50 mV/g
  double accelerometer_range = 100 * 9.80665;          ///< m/s^2
  int bits = 24;                                       ///< converter over +- 10 V; 0 = none
  double converter_noise = 0.1e-3;                     ///< V rms
  double direction = 0;                                ///< of the blow, rad from x
  std::uint64_t seed = 1;
};
/// One Recording per blow: force (N), acc_x, acc_y (m/s^2).
std::vector<Recording> simulate_hammer_test(const RigParameters& parameters, const HammerTestOptions& options = {});

}  // namespace whirl::rig
