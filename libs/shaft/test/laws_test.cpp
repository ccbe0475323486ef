// The laws of a flexible rotor's feedback: one suite for all of them, closed form of each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "control/sampled_plant.hpp"
#include "rotors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/control/design.hpp"
#include "whirl/shaft/control/passages.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

using Eigen::VectorXd;
using ::testing::HasSubstr;
using testing::kRpm;
using ::testing::ThrowsMessage;

Rotor magnets() { return parse_rotor(rotor_template("levitated"), "levitated"); }

ControlOptions options_of(const std::string& law, double to = 9000 * kRpm) {
  ControlOptions o;
  o.law = law;
  o.to = to;
  o.sample_time = 1e-4;
  o.schedule = 3;
  o.checked = 5;
  return o;
}

/// Random magnets, discs and masses: what is not refused stays bounded in a run with more modes.
class ShaftLawProperty : public ::testing::TestWithParam<std::string> {};

TEST_P(ShaftLawProperty, WhatIsNotRefusedIsStable) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(0, 1);
  // pid looks at more numbers, each at every speed.
  for (int seed = 0; seed < (GetParam() == "pid" ? 3 : 6); ++seed) {
    Rotor rotor = magnets();
    for (Actuator& a : rotor.actuators) a.bias_stiffness = -1e5 - 4e5 * part(random);
    rotor.discs[1].position = 0.2 + 0.2 * part(random);
    rotor.discs[1].mass *= 0.7 + part(random);
    const ControlOptions options = options_of(GetParam(), 6000 * kRpm);
    const ControlDesign design = design_rotor_control(rotor, options);
    EXPECT_TRUE(design.refused.empty()) << seed;
    EXPECT_LT(design.worst_sensitivity, 3) << seed;
    rotor.unbalances = {{0.3, 0.3, 1e-6, 0}};
    const System full = assemble(rotor);
    ASSERT_TRUE(stability_threshold(full, 0, 600));
    RunOptions run;
    run.from = run.to = 6000 * kRpm * part(random);
    run.duration = 0.3;
    run.sample_time = 1e-4;
    run.tolerance = 1;
    const System many = reduce(full, {.modes = 16}).system;
    run.control = sampled_forces(rotor, many, design.controller);
    const RotorRun r = simulate_run(many, run);
    ASSERT_TRUE(r.x.allFinite()) << seed;
    const auto size = [&](Eigen::Index from) { return r.x.middleCols(from, 1000).cwiseAbs().maxCoeff(); };
    EXPECT_LT(size(2000), 2 * size(0) + 1e-9) << seed;
    EXPECT_LT(size(2000), 1e-3) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShaftLawProperty, ::testing::ValuesIn(control_laws()));

/// A displacement that grows evenly: spring, damper and integral of a mass at this frequency and damping ratio, and the
/// spring that the magnet takes away.
TEST(ShaftControlReference, PidIsASpringAndADamper) {
  const Rotor rotor = magnets();
  const ControlOptions o = options_of("pid");
  const ControlDesign d = design_rotor_control(rotor, o);
  ASSERT_EQ(d.numbers.size(), 3u);
  EXPECT_EQ(d.numbers[0].name, "frequency");
  const double frequency = d.numbers[0].value, damping = d.numbers[1].value, corner = d.numbers[2].value,
               bias = -rotor.actuators[0].bias_stiffness;
  ASSERT_FALSE(d.controller.gains.empty());
  const ControlGains& g = d.controller.gains.front();
  // One probe and one actuator a direction and place: each force from one reading.
  const Eigen::Index n = g.advance.rows(), probes = g.readings.cols();
  VectorXd state = VectorXd::Zero(n);
  const auto step = [&](const VectorXd& y) {
    state = (g.advance * state + g.readings * y).eval();
    return VectorXd(-g.feedback * state);
  };
  constexpr double kRate = 1e-3;  // m/s
  VectorXd force;
  double time = 0;
  const int count = static_cast<int>(std::ceil(8 / (frequency * o.sample_time)));
  for (int k = 1; k <= count; ++k) {
    time = k * o.sample_time;
    force = step(VectorXd::Constant(probes, kRate * time));
  }
  const double settled = 1 - std::exp(-time * corner * frequency);
  ASSERT_GT(settled, 0.999);
  for (std::size_t j = 0; j < rotor.actuators.size(); ++j) {
    const double mass = 1 / std::pow(PlantFamily(rotor, assemble(rotor), o.modes).at(0, o.sample_time).push, 2);
    const double spring = mass * frequency * frequency, sum = kRate * (time * time + time * o.sample_time) / 2;
    const double wanted =
        -(spring + bias) * kRate * time - 2 * damping * mass * frequency * kRate - 0.1 * frequency * spring * sum;
    EXPECT_NEAR(force[static_cast<Eigen::Index>(j)], wanted, 2e-3 * std::abs(wanted)) << j;
  }
}

/// Runout is no motion: a controller that knows it moves the rotor as one without, one that does not follows it.
TEST_P(ShaftLawProperty, KnownRunoutMovesNothing) {
  const ControlOptions o = options_of(GetParam(), 6000 * kRpm);
  Rotor smooth = magnets(), rough = smooth;
  for (std::size_t k = 0; k < rough.probes.size(); ++k) {
    rough.probes[k].runout = 1e-5;
    rough.probes[k].runout_angle = 0.4 + static_cast<double>(k);
  }
  const RotorController untold = design_rotor_control(smooth, o).controller;
  RotorController told = untold;
  told.probes = rough.probes;
  const System many = reduce(assemble(smooth), {.modes = 8}).system;
  const auto moved = [&](const Rotor& rotor, const RotorController& c) {
    RunOptions run;
    run.from = run.to = 3000 * kRpm;
    run.duration = 0.3;
    run.sample_time = 1e-3;
    run.from_rest = true;
    run.control = sampled_forces(rotor, many, c);
    return simulate_run(many, run);
  };
  const RotorRun without = moved(smooth, untold), with = moved(rough, told), followed = moved(rough, untold);
  EXPECT_LT((with.x - without.x).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_GT((followed.x - without.x).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(ShaftControl, LawsNameWhatTheyCannotDo) {
  Rotor rotor = magnets();
  ControlOptions o = options_of("pdi");
  EXPECT_THAT([&] { design_rotor_control(rotor, o); }, ThrowsMessage<Error>(HasSubstr("lqg, pid")));
  o.law = "pid";
  std::erase_if(rotor.probes, [](const Probe& p) { return std::abs(p.angle) > 1; });
  EXPECT_THAT([&] { design_rotor_control(rotor, o); }, ThrowsMessage<Error>(HasSubstr("no probe reads along it")));
}

}  // namespace
}  // namespace whirl::shaft
