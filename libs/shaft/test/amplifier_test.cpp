// Amplifiers that follow late, and the forces that carry a rotor in magnets.
#include <gtest/gtest.h>

#include <cmath>

#include "control/closed_loop.hpp"
#include "control/sampled_plant.hpp"
#include "whirl/shaft/control/design.hpp"
#include "whirl/shaft/control/passages.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTurnPerSecond = 6.283185307179586, kPerRpm = kTurnPerSecond / 60;

Rotor rotor_of(const char* name, double bandwidth_hz) {
  Rotor rotor = parse_rotor(rotor_template(name), name);
  for (Actuator& a : rotor.actuators) a.bandwidth = kTurnPerSecond * bandwidth_hz;
  return rotor;
}
ControlOptions magnet_options(double to = 6000 * kPerRpm) {
  ControlOptions o;
  o.to = to;
  o.sample_time = 1e-4;
  o.schedule = 2;
  o.checked = 4;
  return o;
}

/// The force after a step is 1 - exp(-w t): the plant with it agrees with many short steps of the plant without.
TEST(ShaftAmplifierReference, LateForceOfTheSampledPlant) {
  const double w = kTurnPerSecond * 120, sample = 1e-3;
  const Rotor late = rotor_of("active-centrifuge", 120), prompt = rotor_of("active-centrifuge", 0);
  const SampledPlant plant = PlantFamily(late, assemble(late), 3).at(200, sample);
  constexpr int kParts = 400;
  const SampledPlant part = PlantFamily(prompt, assemble(prompt), 3).at(200, sample / kParts);
  VectorXd x = VectorXd::Zero(plant.a.rows()), y = VectorXd::Zero(part.a.rows());
  const VectorXd command = VectorXd::Unit(2, 0) - 0.4 * VectorXd::Unit(2, 1);
  for (int k = 0; k < 20; ++k) {
    x = plant.a * x + plant.b * command;
    for (int i = 0; i < kParts; ++i) {
      const double middle = (k + (i + 0.5) / kParts) * sample;
      y = part.a * y + part.b * command * (1 - std::exp(-w * middle));
    }
    EXPECT_LT((plant.c * x - part.c * y).norm(), 2e-5 * (part.c * y).norm()) << k;
  }
}

/// The steady forces of a run are those of the transfer functions, amplifier included: no sample more or less between
/// them.
TEST(ShaftAmplifierReference, RunAgreesWithTransferFunctions) {
  for (const double bandwidth : {0.0, 60.0}) {
    const Rotor rotor = rotor_of("active-centrifuge", bandwidth);
    ControlOptions o;
    o.from = o.to = 2193 * kPerRpm;
    o.schedule = o.checked = 1;
    o.adaptation = 0;
    const ControlDesign d = design_rotor_control(rotor, o);
    EXPECT_TRUE(d.refused.empty());
    const System reduced = reduce(assemble(rotor)).system;
    RunOptions run;
    run.from = run.to = o.to;
    run.duration = 4;
    run.sample_time = o.sample_time;
    run.control = sampled_forces(rotor, reduced, d.controller);
    const RotorRun r = simulate_run(reduced, run);
    const double size = r.forces.row(0).tail(2000).cwiseAbs().maxCoeff();
    const double follows = bandwidth > 0 ? 1 / std::hypot(1, o.to / rotor.actuators[0].bandwidth) : 1;
    EXPECT_NEAR(size / (follows * d.points.front().turning_force[0]), 1, 1e-2) << bandwidth;
  }
}

/// A controller that does not know of a slow amplifier is refused on it, one designed for it is not.
TEST(ShaftAmplifierRefusal, SlowAmplifierThatTheDesignDidNotKnow) {
  const Rotor prompt = rotor_of("levitated", 0), slow = rotor_of("levitated", 120);
  const ControlOptions o = magnet_options();
  EXPECT_FALSE(check_rotor_control(slow, design_rotor_control(prompt, o).controller, o).refused.empty());
  const ControlDesign known = design_rotor_control(slow, o);
  EXPECT_TRUE(known.refused.empty());
  EXPECT_LT(known.worst_sensitivity, 3);
}

/// Magnets carry a lying rotor: what sags at first comes back to where the probes read zero.
class ShaftLawsProperty : public ::testing::TestWithParam<std::string> {};

TEST_P(ShaftLawsProperty, ForcesThatCarryTheWeightAreLearned) {
  Rotor rotor = rotor_of("levitated", 800);
  rotor.vertical = false;
  rotor.unbalances.clear();
  ControlOptions o = magnet_options();
  o.law = GetParam();
  o.adaptation = 0;
  const ControlDesign d = design_rotor_control(rotor, o);
  EXPECT_TRUE(d.refused.empty());
  EXPECT_LT(d.worst_sensitivity, 3);
  const System many = reduce(assemble(rotor), {.modes = 12}).system;
  RunOptions run;
  run.from = run.to = 1000 * kPerRpm;
  run.duration = 1;
  run.sample_time = 1e-3;
  run.from_rest = run.weight = true;
  run.control = sampled_forces(rotor, many, d.controller);
  const RotorRun r = simulate_run(many, run);
  ASSERT_TRUE(r.x.allFinite());
  double carried = 0;
  const Eigen::Index last = r.time.size() - 1;
  for (Eigen::Index j = 0; j < 4; ++j) {
    const Actuator& a = rotor.actuators[static_cast<std::size_t>(j)];
    if (std::abs(a.angle) > 1) carried += r.forces(j, last) - a.bias_stiffness * r.y(many.node_at(a.a.position), last);
  }
  EXPECT_NEAR(carried / (9.80665 * rotor.mass()), 1, 1e-3);
  for (const Probe& p : rotor.probes) {
    const auto y = r.y.row(many.node_at(p.position));
    EXPECT_GT(y.cwiseAbs().maxCoeff(), 1e-6) << p.name;
    EXPECT_LT(std::abs(y[y.size() - 1]), 2e-7) << p.name;
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShaftLawsProperty, ::testing::ValuesIn(control_laws()));

TEST(ShaftAmplifierFile, BandwidthIsKept) {
  Rotor rotor = rotor_of("levitated", 750);
  EXPECT_NEAR(parse_rotor(rotor_text(rotor), "again").actuators[2].bandwidth, rotor.actuators[2].bandwidth, 1e-9);
}

}  // namespace
}  // namespace whirl::shaft
