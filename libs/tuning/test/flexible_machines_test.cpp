// Flexible rotors under control (testing/control/flexible_machine.hpp): another stiffness moves all of their modes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>

#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/testing/control/flexible_machine.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {
namespace {

using testing::FlexibleMachine;
using testing::FlexibleModes;

FlexibleMachine flexible(std::uint64_t seed) {
  FlexibleMachine m = FlexibleMachine::draw(seed);
  const FlexibleModes modes(m);
  m.from = 2.2 * modes.omega[0];
  m.force_limit = 1.6 * std::abs(modes.unbalance[0] / modes.drive[0]) * m.from * m.from;
  return m;
}

/// What identification, hammer test and data sheets say of it, with their errors.
Hardware sheets_of(const FlexibleMachine& m, const FlexibleModes& modes) {
  rig::RigParameters p;
  p.profile = {.omega_start = m.from, .omega_end = m.to, .ramp_time = m.ramp, .dwell_end = m.still};
  p.laser.noise = m.noise, p.laser.rate = 0, p.laser.latency = 0.25e-3;
  p.laser.runout_1x = m.runout[0], p.laser.runout_2x = m.runout[1], p.laser.runout_3x = 0;
  p.actuator.force_per_volt = m.force_limit / p.actuator.voltage_limit;
  p.actuator.bandwidth = 1 / (2 * std::numbers::pi * m.lag);
  p.actuator.delay_samples = 1;
  p.encoder.counts = m.counts;
  Hardware h = data_sheet(p);
  for (int k = 1; k < 3; ++k) {
    const double share = modes.seen[k] * modes.drive[k] / (modes.seen[0] * modes.drive[0]);
    h.modes.push_back({modes.omega[k] / (2 * std::numbers::pi), m.damping * std::sqrt(modes.omega[k] / modes.omega[0]),
                       std::abs(share), share < 0 ? -1.0 : 1.0, 0});
  }
  return h;
}

/// `lqi`, kfo with these numbers.
ControllerDesign turning_integral(const FlexibleMachine& m, const std::map<std::string, double>& numbers) {
  const FlexibleModes modes(m);
  IdentifiedModel model;
  model.method = "stand-in";
  RotorModel& r = model.rotor.emplace();
  r.k1 = 1.01 * modes.omega[0] * modes.omega[0], r.c = 1.15 * 2 * m.damping * modes.omega[0];
  r.gain = modes.seen[0] * modes.drive[0];
  r.eps = 0.97 * modes.seen[0] * modes.unbalance[0] * std::polar(1.0, 0.04);
  DesignOptions o;
  o.law = "lqi", o.estimator = "kfo", o.feedforward = false;
  o.hardware = sheets_of(m, modes);
  o.fixed = numbers;
  o.evaluations = 1, o.threads = 1;
  return design(model, o);
}

/// Peak at the critical speed, m; infinite where supervision steps in.
double held_peak(const ControllerDesign& d, FlexibleMachine m, double stiffness, double critical) {
  m.young *= stiffness, m.from = m.to = critical, m.still = 0.5;
  control::Controller controller = control::make_controller(d);
  testing::FlexibleRig rig(m, 17);
  double peak = 0;
  for (; !rig.done(); rig.advance()) {
    const auto u = controller.step(rig.read());
    if (!u || (controller.state().supervision.word & control::kUnheld) != 0) return 1e9;
    rig.write(*u);
    if (rig.read().t > 0.5) peak = std::max(peak, std::abs(rig.z().real()));
  }
  return peak;
}

// The first of these designs answers the second bending mode, at 147 Hz, so closely that 4 % more stiffness makes it
// ring: certified with 0.04 mm where six of 20 machines of its make reached 0.6 mm.
TEST(CertificateE2e, AFlexibleRotorOfAnotherStiffnessIsHeldWhereTheDesignIsCertified) {
  const std::map<std::string, double> rings{{"position_scale", 0.00252484}, {"velocity_scale", 1},
                                            {"control_scale", 3},           {"integral_scale", 1.79348e-05},
                                            {"acceleration_noise", 2.3878}, {"oscillator_walk", 21.2881}};
  const std::map<std::string, double> holds{
      {"position_scale", 0.00501187},  {"velocity_scale", 1},           {"control_scale", 3},
      {"integral_scale", 2.03718e-06}, {"acceleration_noise", 1.32138}, {"oscillator_walk", 0.826689}};
  int certified = 0;
  for (const auto& [seed, numbers] : {std::pair{8004U, rings}, std::pair{8009U, holds}}) {
    const FlexibleMachine m = flexible(seed);
    const ControllerDesign d = turning_integral(m, numbers);
    const double stated = d.margins.at("peak_m"), critical = FlexibleModes(m).omega[0];
    fmt::print("machine {}: certified {}, stated {:.4f} mm\n", seed, d.margins.at("certified"), 1e3 * stated);
    if (d.margins.at("certified") != 1) continue;
    ++certified;
    for (const double stiffness : {0.94, 1.0, 1.06})
      EXPECT_LE(held_peak(d, m, stiffness, critical), stated) << seed << " " << stiffness;
  }
  EXPECT_GE(certified, 1);
}

}  // namespace
}  // namespace whirl::tuning
