#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/pipeline/closed_loop.hpp"
#include "whirl/pipeline/design.hpp"

namespace whirl {

/// One condition of the robustness matrix and how the design did under it.
struct RobustnessCase {
  std::string name;
  ClosedLoopMetrics metrics;
};

/// The design, unchanged, on rigs that differ from the one it was made for: stiffness +-30 %, damping +-50 %,
/// twice the unbalance, one to three samples of delay it is told and it is not told, structural modes 3 and
/// 15 times as strong, actuators of half and an eighth of the force (told, as their data sheet is), 50 ms
/// without sensor at the critical speed, angle from the speed profile instead of the encoder, five times the speed-loop
/// ripple, ten times the sensor noise, run-up instead of run-down.
std::vector<RobustnessCase> robustness_matrix(const ControllerDesign& design, const RigParameters& rig,
                                              std::uint64_t seed = 1, int threads = 0);

struct MonteCarloOptions {
  int samples = 200;
  std::uint64_t seed = 1;
  int threads = 0;              ///< 0 = all cores; the result does not depend on it
  double covariance_scale = 1;  ///< factor on the identified standard deviations
  /// Relative standard deviations added to the identified ones: what a covariance of the noise alone does not
  /// hold.
  double stiffness_sd = 0.05, damping_sd = 0.2, unbalance_sd = 0.02;
  double gain_sd = 0.03;      ///< of the actuator gain, relative
  double rotation_sd = 0.02;  ///< of the actuator axes, rad
};

struct MonteCarloSample {
  RotorModel model;        ///< the rotor drawn
  double peak = 0;         ///< whole run, x axis, zero-to-peak, m
  double suppression = 0;  ///< whole run, fraction
  bool stable = false;
};

struct MonteCarloResult {
  std::vector<MonteCarloSample> samples;
  double peak_median = 0, peak_p95 = 0, peak_worst = 0;  ///< m
  double stable_fraction = 0;
  double stable_low = 0;  ///< lower end of the one-sided 95 % Wilson interval of the stable fraction
};

/// Draws rotors from the identified covariance (IdentifiedModel::rotor_covariance, may be empty) and hardware
/// tolerances, runout phases and sensor noise, and runs the design on each. Sample i depends on (seed, i)
/// alone. Throws Error when the model has no rotor or input gain, or the covariance is not 5 x 5 and positive
/// semi-definite.
MonteCarloResult monte_carlo(const ControllerDesign& design, const IdentifiedModel& model,
                             const Hardware& hardware, const MonteCarloOptions& options = {});

}  // namespace whirl
