#pragma once
#include <array>
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

/// A measuring chain up to its converter.
struct MeasuringChain {
  double volt_per_unit = 0;  ///< V/N or V s^2/m
  double range = 0;          ///< N or m/s^2
};

/// Instrumented hammer and accelerometers of paper section IV-B on the rotor at rest.
struct HammerTestOptions {
  int blows = 5;
  double rate = 2048;                              ///< Hz
  double duration = 8;                             ///< of one record, s
  double pretrigger = 0.05;                        ///< s before the blow
  std::array<double, 2> force = {40, 150};         ///< peak force of the blows, uniform between, N
  std::array<double, 2> pulse = {2.5e-3, 3.5e-3};  ///< length of the half sine, uniform between, s
  MeasuringChain hammer = {.volt_per_unit = 0.1 / 4.4482216, .range = 222.4};                ///< 100 mV/lbf, 50 lbf
  MeasuringChain accelerometer = {.volt_per_unit = 0.05 / 9.80665, .range = 100 * 9.80665};  ///< 50 mV/g, 100 g
  int bits = 24;                    ///< converter over +- 10 V; 0 = none
  double converter_noise = 0.1e-3;  ///< V rms
  double direction = 0;             ///< of the blow, rad from x
  std::uint64_t seed = 1;
};
/// One Recording per blow: force (N), acc_x, acc_y (m/s^2).
std::vector<Recording> simulate_hammer_test(const RigParameters& parameters, const HammerTestOptions& options = {});

}  // namespace whirl::rig
