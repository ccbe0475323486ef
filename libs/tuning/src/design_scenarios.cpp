#include "design_scenarios.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::tuning {

std::vector<TuningScenario> tuning_scenarios(const Hardware& hardware, double stiffness_uncertainty) {
  const auto error = [](double scale, double degrees) { return std::polar(scale, degrees * std::numbers::pi / 180); };
  // More than what is certified: a design must not live on the frequencies of the hammer test.
  constexpr double kOff = 0.003;
  std::vector<TuningScenario> all{
      {"nominal", 1, 1.1, 0.8, error(1.04, -4)},
      {"one more sample of delay", 1, 1, 1, error(0.96, 4), 1, 1},
      {"model 15 % too stiff", 1 / 1.15, 1, 1.2, error(1.04, 4), 1, 0, 1, false, 1, 1 - kOff},
      {"stiffness at its lower bound", 1 - stiffness_uncertainty, 1, 1, error(0.96, -4), 1, 0, 1, false, 1, 1 + kOff},
      {"balanced, actuators 25 % stronger", 1, 1, 1, error(1.2, -8), 0.16, 0, 1, false, 1.25},
  };
  if (!hardware.modes.empty()) {
    all.push_back({"stronger structural modes", 1, 1, 1, error(1.04, -4), 1, 0, 1.5});
    if (hardware.sign_cases().size() > 1) {
      all.push_back({"stronger structural modes of the other sign", 1, 1, 1, error(1.04, -4), 1, 0, 1.5, true});
    }
  }
  // No hammer test says how the structure rings when a run begins. On plants whose structure is still a search prefers
  // laws that pass its ringing on to the disk.
  for (TuningScenario& s : all) s.ringing = 0.1;
  return all;
}

ClosedLoopPlant scenario_plant(const TuningScenario& s, const RotorModel& model, const Hardware& hardware,
                               std::uint64_t seed) {
  RotorModel m = model;
  m.k1 *= s.stiffness;
  m.k1_conj *= s.stiffness;
  m.k2 *= s.cubic;
  m.c *= s.damping;
  m.eps *= s.unbalance * s.told_unbalance;
  Hardware h = s.other_signs ? hardware.sign_cases().back() : hardware;
  h.forces.k3 *= s.cubic;
  h.forces.k2_axis *= s.cubic;
  rig::RigParameters p = tuning_plant(m, h);
  p.actuator.extra_delay_samples = s.extra_delay;
  p.actuator.gain_error = (1 + p.actuator.gain_error) * s.gain - 1;
  p.actuator.axis_rotation += s.axis;
  const double speed = std::abs(model.eps) * std::max(hardware.profile.omega_start, hardware.profile.omega_end);
  for (rig::RigMode& mode : p.modes) {
    mode.participation *= s.modes;
    mode.frequency *= s.mode_frequency;
    mode.initial = std::max(mode.initial, s.ringing * speed / (2 * std::numbers::pi * mode.frequency));
  }
  ClosedLoopOptions options;
  options.run.seed = seed;
  return ClosedLoopPlant(p, options);
}

Hardware tuning_hardware(const ControllerDesign& design, const Hardware& hardware) {
  Hardware h = hardware;
  const auto removed = [](const auto& p) { return p.first.starts_with("runout_") && p.second != 0; };
  if (std::ranges::any_of(design.parameters, removed)) {
    h.laser.runout_1x *= 0.1;
    h.laser.runout_2x *= 0.1;
    h.laser.runout_3x *= 0.1;
  }
  return h;
}

ControllerDesign on_scenario(ControllerDesign design, const TuningScenario& s) {
  design.model.eps *= s.told_unbalance;
  design.model.offset = 0;
  std::erase_if(design.parameters, [](const auto& p) { return p.first.starts_with("runout_"); });
  return design;
}

double tuning_cost(const ClosedLoopMetrics& m) {
  constexpr double kLimitCycle = 30e-6;  // m rms at standstill
  if (m.survived < 1) return 4 - m.survived;
  double ratio = 0;
  int entered = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    if (m.open.segment[i] > 0) ratio += m.closed.segment[i] / m.open.segment[i], ++entered;
  }
  double cost = 0.5 * ratio / std::max(entered, 1) + 0.5 * m.closed.all / m.open.all + 0.02 * m.total_variation / 1000;
  // Graded, so that a search can climb out.
  if (m.standstill_rms > kLimitCycle) cost += 1 + std::min(1.0, std::log10(m.standstill_rms / kLimitCycle));
  if (m.standing_rms > 0) cost += 1 + std::clamp(std::log10(m.standing_rms / kLimitCycle), 0.0, 1.0);
  if (m.saturated > 0.3) cost += m.saturated;
  return cost;
}

}  // namespace whirl::tuning
