#include "runs/design_scenarios.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

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

std::string course_name(Course course) {
  switch (course) {
    case Course::profile:
      return "the profile as it is";
    case Course::reversed:
      return "the profile reversed";
    case Course::dwell:
      return "the critical speed held";
    case Course::swinging:
      return "the speed swinging about the critical one";
  }
  return {};
}

rotor::SpeedProfile profile_of(Course course, rotor::SpeedProfile p, double natural) {
  // Long enough that what stands is seen (VerdictLimits::standing_time), as long as a slow passage takes.
  constexpr double kHeld = 6;  // s
  // Speed of a converter-fed induction motor without feedback under load: slip of a few per cent, found within seconds.
  constexpr double kSwing = 0.02, kSwingTime = 3;  // s
  if (course == Course::profile) return p;
  if (course == Course::reversed) {
    std::swap(p.omega_start, p.omega_end);
    std::swap(p.dwell_start, p.dwell_end);
    return p;
  }
  // Reached as the profile does: a run that begins there would begin on the orbit of the uncontrolled rotor.
  p.ramp_time *= std::abs((natural - p.omega_start) / (p.omega_end - p.omega_start));
  p.omega_end = natural;
  p.dwell_end = kHeld;
  if (course == Course::swinging) p.ripple = kSwing, p.ripple_omega = 2 * std::numbers::pi / kSwingTime;
  return p;
}

bool passes_critical(const RotorModel& model, const Hardware& hardware) {
  const auto [low, high] = std::minmax({std::abs(hardware.profile.omega_start), std::abs(hardware.profile.omega_end)});
  return low < model.natural_frequency() && model.natural_frequency() < high;
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
  p.profile = profile_of(s.course, p.profile, p.natural_frequency());
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
  constexpr double kLeft = 0.1;
  Hardware h = hardware;
  const std::array runout{&h.laser.runout_1x, &h.laser.runout_2x, &h.laser.runout_3x};
  for (std::size_t k = 0; k < runout.size(); ++k) {
    const std::string harmonic = "_" + std::to_string(k + 1);
    const auto removed = [&](const auto& p) {
      return p.first.starts_with("runout_") && p.first.ends_with(harmonic) && p.second != 0;
    };
    if (!std::ranges::any_of(design.parameters, removed)) continue;
    *runout[k] = std::max(kLeft * *runout[k], k == 0 ? hardware.runout_error : 0);
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
