#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/control/controller.hpp"
#include "whirl/testing/control/controlled_machine.hpp"
#include "whirl/testing/control/identified_machine.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/loop_margins.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {
namespace {

using testing::Machine;
using testing::machine;
constexpr double kMass = 1.5, kSeconds = 8, kStartHz = 30;

IdentifiedModel model_of(const Machine& m) { return testing::identified(m, kMass); }

/// Sensors and actuators without error, one tick of computation.
DesignOptions exact(double kp, double kd) {
  DesignOptions o;
  o.law = "pd";
  o.estimator = "difference";
  o.feedforward = false;
  o.fixed = {{"kp", kp}, {"kd", kd}};
  Hardware& h = o.hardware;
  h.laser = rig::RigParameters::ideal_rotor_a().laser;
  h.actuator.bits = 0, h.actuator.gain_error = h.actuator.axis_rotation = 0, h.actuator.bandwidth = 0;
  h.actuator.voltage_limit = 1e3;
  h.encoder.counts = 0;
  h.profile = rotor::SpeedProfile::run_down(2 * std::numbers::pi * kStartHz, kSeconds);
  return o;
}

testing::ControlledRun apart(const Machine& m, const ControllerDesign& design, const testing::Run& run, double gain = 1,
                             double push = 0) {
  ControllerDesign d = design;
  d.parameters["supervise"] = 0;
  control::Controller controller = control::make_controller(d);
  return testing::controlled(
      m, run, kMass, gain, [&](const Measurement& s) { return controller.step(s); }, push);
}

struct Case {
  const char* name;
  void (*add)(Machine&);
  double least;  ///< change of the peak by the force, relative
};

const Case kCases[] = {
    {"quintic", [](Machine& m) { m.quintic = 3e14; }, 0.03},
    {"per axis", [](Machine& m) { m.cubic_axis = 8e8; }, 0.03},
    {"quadratic damping", [](Machine& m) { m.quadratic = 40; }, 0.03},
    {"dry friction", [](Machine& m) { m.dry = 0.2; }, 0.03},
    {"gyroscopic", [](Machine& m) { m.gyroscopic = 0.2; }, 0.03},
    {"rotating damping", [](Machine& m) { m.c_rotating = 6; }, 0.03},
    {"cross-coupled", [](Machine& m) { m.cross = 200; }, 0.03},
    {"stiffness with speed", [](Machine& m) { m.k_with_speed = 0.3, m.top_speed = 100; }, 0.03},
    {"damping with speed", [](Machine& m) { m.c_with_speed = 2, m.top_speed = 100; }, 0.03},
    {"stiffness in time", [](Machine& m) { m.k_in_time = -0.3, m.horizon = kSeconds; }, 0.03},
    {"damping in time", [](Machine& m) { m.c_in_time = 3, m.horizon = kSeconds; }, 0.03},
};

// Before, the lanes ran the rotor without the force.
TEST(FurtherForcesReference, TheClosedLoopPeakOfEveryForceIsThatOfAMachineIntegratedApart) {
  const testing::Run run{.from_hz = kStartHz, .to_hz = 0, .seconds = kSeconds};
  const DesignOptions o = exact(0, 1);
  MonteCarloOptions study;
  study.samples = study.lanes = 8;
  study.threads = 1;
  study.stiffness_sd = study.damping_sd = study.unbalance_sd = study.gain_sd = study.rotation_sd = study.sheet_sd = 0;
  for (const Case& c : kCases) {
    Machine m = machine();
    const ControllerDesign design = untuned_design(model_of(m), o);
    const double plain = apart(m, design, run).peak_x;
    c.add(m);
    const double peak = apart(m, design, run).peak_x;
    EXPECT_GT(std::abs(peak / plain - 1), c.least) << c.name;
    const MonteCarloResult lanes = monte_carlo(design, model_of(m), o.hardware, study);
    EXPECT_NEAR(lanes.samples[3].peak, peak, 0.01 * peak) << c.name << " " << plain;
  }
}

// Rotating damping above its onset: the loop needs a least gain, which the rotor without that force does not.
TEST(FurtherForcesReference, TheLeastGainThatHoldsAnUnstableRotorIsFound) {
  Machine m = machine();
  m.e = 1e-6;
  m.c_rotating = 5;
  const testing::Run run{.from_hz = kStartHz, .to_hz = kStartHz, .seconds = 6};
  for (const auto& [gyroscopic, cross] : {std::pair{0.0, 0.0}, {0.1, 0.0}, {0.0, 150.0}}) {
    m.gyroscopic = gyroscopic, m.cross = cross;
    const DesignOptions o = exact(0, 30);
    const ControllerDesign design = untuned_design(model_of(m), o);
    double low = 0, high = 1;
    while (high - low > 1e-3) {
      const double middle = 0.5 * (low + high);
      // A push that the springs answer linearly, far above what the unbalance leaves.
      const bool grows = apart(m, design, run, middle, 2e-3).growth(1, 6) > 0;
      (grows ? low : high) = middle;
    }
    ASSERT_GT(low, 0.1);
    MarginOptions margins;
    margins.speeds = 1;  // the top of the profile
    const std::vector<MarginStudy> found = margin_studies(design, model_of(m), o, margins);
    EXPECT_TRUE(found[0].speeds[0].margins.stable);
    EXPECT_NEAR(found[0].speeds[0].margins.gain_down, low, 0.03 * low) << gyroscopic << " " << cross;
    // With less there is no margin to speak of: it is not stable.
    const ControllerDesign weak = untuned_design(model_of(m), exact(0, 0.8 * 30 * low));
    EXPECT_FALSE(margin_studies(weak, model_of(m), o, margins)[0].speeds[0].margins.stable);
  }
}

// A rotor that whirls by itself in the upper half of the range: designs were refused.
TEST(FurtherForcesE2e, ADesignHoldsARotorThatWhirlsByItself) {
  Machine m = machine();
  m.c_rotating = 5;
  const testing::Run run{.from_hz = kStartHz, .to_hz = 0, .seconds = kSeconds};
  DesignOptions o = exact(0, 0);
  o.fixed.clear();
  o.estimator = "lpf";
  o.evaluations = 30;
  const ControllerDesign design = tuning::design(model_of(m), o);
  ASSERT_EQ(design.margins.at("certified"), 1) << design.summary.warnings.front();
  EXPECT_GT(design.margins.at("gain_margin_down"), 0);
  EXPECT_NE(design.summary.trust.find("rotating damping"), std::string::npos) << design.summary.trust;
  bool said = false;
  for (const std::string& w : design.summary.warnings) said |= w.find("whirls by itself from") != std::string::npos;
  EXPECT_TRUE(said);
  const double peak = apart(m, design, run).peak_x;
  EXPECT_LT(peak, 1.1 * design.margins.at("peak_m"));
  // Without the loop it leaves its bearings.
  EXPECT_GT(apart(m, design, run, 0).peak_x, 20 * peak);
}

TEST(FurtherForces, FrictionTooSuddenForTheStepsIsNamed) {
  Machine m = machine();
  m.dry = 0.2;
  IdentifiedModel model = model_of(m);
  const Hardware h;
  EXPECT_TRUE(forces_left_out(model, h).empty());
  EXPECT_GT(with_forces(h, model).timing.substeps, 4 - 1);
  for (auto& [name, value] : model.parameters) {
    if (name == "friction_speed") value.value = 1e-9;
  }
  EXPECT_EQ(names_of(forces_left_out(model, h)), "Coulomb friction");
  EXPECT_EQ(with_forces(h, model).forces.friction, 0);
  Summary summary;
  state_parts(identification::Consumer::design, model, h, summary);
  ASSERT_EQ(summary.warnings.size(), 1u);
  const Finding* left = summary.find(FindingCode::part_left_out);
  ASSERT_NE(left, nullptr);
  EXPECT_EQ(left->where, "Coulomb friction");
  EXPECT_EQ(left->amount("friction"), 0.2);
}

}  // namespace
}  // namespace whirl::tuning
