#include "whirl/tuning/design.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "rig_design.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rig/records.hpp"

namespace whirl::tuning {
namespace {

/// What an identification of the default rig gives: stiffness 1 % and cubic 10 % off, damping 30 % high,
/// unbalance 4 % and 4 degrees off, anisotropy not seen.
IdentifiedModel model_found(const rig::RigParameters& rig) {
  IdentifiedModel m = round_model(rig);
  m.rotor->k1 *= 1.01;
  m.rotor->k2 *= 0.9;
  m.rotor->c *= 1.3;
  m.rotor->eps *= std::polar(0.96, 4 * std::numbers::pi / 180);
  return m;
}

DesignOptions options_for(const rig::RigParameters& rig, const char* law, const char* estimator, int evaluations) {
  DesignOptions o;
  o.law = law;
  o.estimator = estimator;
  o.hardware = data_sheet(rig);
  o.evaluations = evaluations;
  return o;
}

TEST(DesignE2e, EquationAsPrintedExceedsThePaperOnTheRig) {
  const rig::RigParameters rig;
  const ControllerDesign d = design(model_found(rig), options_for(rig, "tsmc_paper", "lpf", 24));
  ClosedLoopOptions run;
  run.run.seed = 77;
  const ClosedLoopMetrics m = ClosedLoopPlant(rig, run).run(d);
  ASSERT_TRUE(m.stable);
  // Table 4: 61, 91, 96, 81.8, 92.7 % and 0.16, 0.20, 0.26, 0.47 mm.
  EXPECT_GE(m.suppression.segment[0], 0.61);
  EXPECT_GE(m.suppression.segment[1], 0.91);
  EXPECT_GE(m.suppression.segment[2], 0.96);
  EXPECT_GE(m.suppression.segment[3], 0.818);
  EXPECT_GE(m.suppression.all, 0.927);
  EXPECT_LE(m.closed.segment[0], 0.16e-3);
  EXPECT_LE(m.closed.all, 0.47e-3);
}

// A structure that rings when the run begins (30 um at 46 Hz on the rig): laws tuned on a still one passed it on to the
// disk, 33 um instead of 21, because nothing told the tuning.
TEST(DesignUnit, ALawThatPassesTheRingingOfTheStructureOnCostsMore) {
  rig::RigParameters rig;
  rig.laser.runout_1x = rig.laser.runout_2x = rig.laser.runout_3x = 0;
  DesignOptions o = options_for(rig, "pd", "lpf", 1);
  o.hardware.laser.runout_1x = o.hardware.laser.runout_2x = o.hardware.laser.runout_3x = 0;
  o.hardware.modes = rig.modes;
  for (rig::RigMode& mode : o.hardware.modes) mode.initial = 0;
  IdentifiedModel model = model_found(rig);
  model.rotor->eps = rig.true_model().eps;
  // What the ringing adds to the cost, and the peak on the rig.
  const auto rise_and_peak = [&](const std::map<std::string, double>& fixed) {
    o.fixed = fixed;
    const ControllerDesign d = untuned_design(model, o);
    double rise = 0;
    for (TuningScenario s : tuning_scenarios(o.hardware, o.stiffness_uncertainty)) {
      const Hardware hardware = tuning_hardware(d, o.hardware);
      rise += tuning_cost(scenario_plant(s, d.model, hardware, 1).run(on_scenario(d, s)));
      s.ringing = 0;
      rise -= tuning_cost(scenario_plant(s, d.model, hardware, 1).run(on_scenario(d, s)));
    }
    return std::pair(rise, ClosedLoopPlant(rig).run(d).closed.all);
  };
  const auto [passed_on, high] = rise_and_peak({{"kp", -831}, {"kd", 312}, {"cancel", 1}, {"cutoff", 152}});
  const auto [kept, low] = rise_and_peak({{"kp", -3623}, {"kd", 27.77}, {"cancel", 1}, {"cutoff", 426.7}});
  EXPECT_GT(high, 1.3 * low);
  EXPECT_GT(passed_on, 0.02);
  EXPECT_LT(std::abs(kept), 0.1 * passed_on);
}

TEST(DesignE2e, EccentricityObserverReachesTheStretchTargets) {
  const rig::RigParameters rig;
  const IdentifiedModel model = model_found(rig);
  ControllerDesign d = design(model, options_for(rig, "lsmc", "kfe", 30));
  EXPECT_EQ(d.margins.at("certified"), 1);
  EXPECT_GE(d.margins.at("delay_margin_s"), 1e-3);
  ClosedLoopOptions run;
  run.run.seed = 77;
  const ClosedLoopMetrics m = ClosedLoopPlant(rig, run).run(d);
  ASSERT_TRUE(m.stable);
  EXPECT_LE(m.closed.all, 0.030e-3);
  EXPECT_GE(m.suppression.segment[0], 0.93);
  EXPECT_LE(m.total_variation, 500);

  rig::RigParameters twice = rig;
  twice.rotor.residual_eccentricity *= 2;
  twice.rotor.added_mass *= 2;
  EXPECT_LE(ClosedLoopPlant(twice, run).run(d).closed.all, 0.045e-3);

  rig::RigParameters balanced = rig;
  balanced.rotor.added_mass = 0;
  ControllerDesign own = d;
  own.model.eps = balanced.eccentricity() * std::polar(0.96, 0.07);
  EXPECT_LE(ClosedLoopPlant(balanced, run).run(own).closed.all, 0.018e-3);

  // A loop delayed by one sample more, and one that loses the sensor for 50 ms on the critical speed.
  rig::RigParameters late = rig;
  late.actuator.extra_delay_samples = 1;
  EXPECT_TRUE(ClosedLoopPlant(late, run).run(d).stable);
  run.run.faults = {{rig::RigFault::sensor_loss, 8.0, 8.05}};
  const ClosedLoopMetrics lost = ClosedLoopPlant(rig, run).run(d);
  EXPECT_EQ(lost.held, 50);
  EXPECT_LE(lost.closed.all, 0.06e-3);
}

TEST(DesignE2e, RunoutFromASlowRollIsRemoved) {
  // Slow roll at a twentieth of the critical speed, then the same machine with 5 g: below the runout of 20
  // um.
  rig::RigParameters slow;
  slow.profile = rotor::SpeedProfile::run_down(3.5, 9, 0);
  slow.profile.omega_end = 2.5;
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "pd", "kfe", 1);
  o.hardware.slow_roll = control::estimate_runout(rig::record_open_loop(slow).measured);
  o.fixed = {{"kp", -450}, {"kd", 27}, {"acceleration_noise", 0.57}, {"eccentricity_walk", 9.4e-6}};
  const ControllerDesign with = untuned_design(model_found(rig), o);
  EXPECT_NEAR(std::hypot(with.parameters.at("runout_x_cos_1"), with.parameters.at("runout_x_sin_1")), 12e-6, 1e-6);
  const ClosedLoopPlant plant(rig);
  const double removed = plant.run(with).closed.all;
  o.hardware.slow_roll.reset();
  EXPECT_LE(removed, 0.015e-3);
  EXPECT_LT(removed, 0.8 * plant.run(untuned_design(model_found(rig), o)).closed.all);
}

TEST(DesignUnit, IdentifiedRunoutIsThatOfThePhasors) {
  IdentifiedModel m;
  const auto set = [&](const char* name, double value) {
    m.parameters.emplace_back(name, Estimate{value, 0, value, value});
  };
  set("runout1+_re", 11e-6), set("runout1+_im", 4e-6), set("runout2-_re", -2e-6), set("runout2-_im", 3e-6);
  const control::Runout r = identified_runout(m);
  for (double beta : {0.0, 0.7, 2.9}) {
    const std::complex<double> expected = std::complex<double>(11e-6, 4e-6) * std::polar(1.0, beta) +
                                          std::complex<double>(-2e-6, 3e-6) * std::polar(1.0, -2 * beta);
    EXPECT_LT(std::abs(r.at(beta) - expected), 1e-15);
  }
  EXPECT_TRUE(identified_runout({}).empty());
}

TEST(DesignProperty, SameResultForAnyNumberOfThreads) {
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "pd", "kfe", 5);
  o.threads = 1;
  const ControllerDesign one = design(model_found(rig), o);
  o.threads = 3;
  long calls = 0;
  o.progress.tuning = [&](const DesignProgress& p) {
    EXPECT_EQ(p.evaluation, ++calls);
    EXPECT_LE(p.best, p.objective);
  };
  const ControllerDesign three = design(model_found(rig), o);
  EXPECT_EQ(one.parameters, three.parameters);
  EXPECT_EQ(one.margins, three.margins);
  EXPECT_GE(calls, 4);
}

// The second part of the search has a third of the budget: of two evaluations none.
TEST(DesignUnit, ASearchOfAnyBudgetEnds) {
  const rig::RigParameters rig;
  for (const int budget : {1, 2, 3}) {
    DesignOptions o = options_for(rig, "pd", "lpf", budget);
    o.progress.tuning = [&](const DesignProgress& p) {
      if (p.evaluation > 20) throw std::runtime_error("goes on");
    };
    EXPECT_NO_THROW(design(model_found(rig), o)) << budget;
  }
}

TEST(DesignUnit, FixedParametersAreNotTouched) {
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "pd", "lpf", 3);
  o.fixed = {{"kd", 24}, {"cutoff", 150}, {"cancel", 0.8}};
  const ControllerDesign d = design(model_found(rig), o);
  EXPECT_EQ(d.parameters.at("kd"), 24);
  EXPECT_EQ(d.parameters.at("cutoff"), 150);
  EXPECT_EQ(d.parameters.at("cancel"), 0.8);
  EXPECT_NEAR(d.delay, 0.25e-3 + 1e-3 + 1 / (400 * std::numbers::pi), 1e-12);
  EXPECT_EQ(d.force_limit, 40);
}

// A correction that is wrong by all it may be changes the gain and the stiffness of the loop by no more than is
// certified.
TEST(DesignUnit, BoundsOfTheReidentificationAreInsideTheCertificate) {
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "pd", "lpf", 4);
  o.fixed = {{"reidentify", 2}, {"reidentify_gain", 0.5}, {"reidentify_stiffness", 0.5}};
  const ControllerDesign d = design(identified_model(rig), o);
  EXPECT_LE(1 / (1 - d.parameters.at("reidentify_gain")), d.margins.at("gain_margin") + 1e-9);
  EXPECT_LE(d.parameters.at("reidentify_stiffness"), o.stiffness_uncertainty);
  EXPECT_EQ(d.parameters.at("reidentify"), 2);
}

TEST(DesignUnit, NegativeStiffnessIsNotCertified) {
  // Cancelling all of a stiffness that is 30 % lower than believed, with too little feedback to make up for
  // it.
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "lsmc", "kalman", 1);
  o.fixed = {{"cancel", 1}, {"surface_gain", 20}, {"switching_gain", 1}, {"boundary_layer", 0.05}};
  ControllerDesign d = untuned_design(model_found(rig), o);
  assess(d, o);
  EXPECT_EQ(d.margins.at("certified"), 0);
  EXPECT_LT(d.margins.at("static_stiffness"), 0);
  EXPECT_NE(d.summary.status, Status::ok);
  d.parameters["cancel"] = 0.5;
  assess(d, o);
  EXPECT_GT(d.margins.at("static_stiffness"), 0);
  EXPECT_EQ(d.margins.at("certified"), 1);
}

TEST(DesignUnit, Equation42IsEvaluated) {
  const rig::RigParameters rig;
  DesignOptions o = options_for(rig, "tsmc", "kfe", 1);
  o.fixed = {{"switching_gain", 8}, {"boundary_layer", 0.3}, {"surface_gain", 40}};
  ControllerDesign d = untuned_design(model_found(rig), o);
  assess(d, o);
  EXPECT_NEAR(d.margins.at("kappa"), 8 - d.margins.at("disturbance_bound"), 1e-12);
  EXPECT_GT(d.margins.at("kappa"), 0);
  EXPECT_GT(d.margins.at("reach_time_s"), 0);
  EXPECT_GT(d.margins.at("slide_time_s"), 0);
  d.parameters["switching_gain"] = 0.5;
  assess(d, o);
  EXPECT_LT(d.margins.at("kappa"), 0);
  EXPECT_EQ(d.margins.count("reach_time_s"), 0u);
  EXPECT_NE(d.summary.status, Status::ok);
}

TEST(DesignUnit, DataSheetTellsNothingOnlyTheRigKnows) {
  rig::RigParameters rig;
  const Hardware before = data_sheet(rig);
  rig.rotor.stiffness *= 2;
  rig.actuator.gain_error = 0.3;
  rig.actuator.axis_rotation = 0.2;
  rig.laser.runout_1x *= 3;
  rig.laser.runout_phase_2x += 1;
  rig.modes.clear();
  rig.profile.ripple = 0.1;
  const Hardware after = data_sheet(rig);
  const RotorModel model = *model_found(rig::RigParameters{}).rotor;
  ControllerDesign d;
  d.law = "pd", d.estimator = "lpf", d.model = model, d.delay = 2e-3;
  const auto a = ClosedLoopPlant(tuning_plant(model, before)).run(d);
  const auto b = ClosedLoopPlant(tuning_plant(model, after)).run(d);
  EXPECT_EQ(a.closed.all, b.closed.all);
  EXPECT_EQ(a.total_variation, b.total_variation);
}

TEST(DesignUnit, ErrorsNameTheField) {
  const rig::RigParameters rig;
  IdentifiedModel model = model_found(rig);
  EXPECT_THROW(design(model, options_for(rig, "tsmcc", "lpf", 5)), Error);
  EXPECT_THROW(design(model, options_for(rig, "tsmc", "lpf", 0)), Error);
  DesignOptions o = options_for(rig, "tsmc", "lpf", 5);
  o.fixed["eponent"] = 0.6;
  EXPECT_THROW(design(model, o), Error);
  model.rotor->gain = 0;
  EXPECT_THROW(design(model, options_for(rig, "tsmc", "lpf", 5)), Error);
  o = options_for(rig, "pd", "lpf", 1);
  o.gain = 1 / 1.5;
  EXPECT_NO_THROW(design(model, o));
  model.rotor.reset();
  EXPECT_THROW(design(model, o), Error);
}

}  // namespace
}  // namespace whirl::tuning
