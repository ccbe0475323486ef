#include "whirl/tuning/robustness.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "monte_carlo/machine_lanes.hpp"
#include "monte_carlo/monte_carlo_draw.hpp"
#include "rig_design.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/core/error.hpp"
#include "whirl/tuning/compare.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {
namespace {

ControllerDesign good_design(const rig::RigParameters& rig, const IdentifiedModel& model) {
  DesignOptions o = options_of(data_sheet(rig));
  o.fixed = {{"kp", -450}, {"kd", 27}, {"acceleration_noise", 0.57}, {"eccentricity_walk", 9.4e-6}};
  return untuned_design(model, o);
}

TEST(RobustnessE2e, WholeMatrixIsStable) {
  const rig::RigParameters rig;
  const auto cases = robustness_matrix(good_design(rig, identified_model(rig)), rig, 5);
  EXPECT_EQ(cases.size(), 21u);
  for (const auto& c : cases) EXPECT_TRUE(c.metrics.stable) << c.name << " " << c.metrics.closed.all;
  // The nominal run, and what the notes' best design kept under every condition but lack of force and a wrong
  // angle.
  EXPECT_LT(cases[0].metrics.closed.all, 0.02e-3);
  for (const auto& c : cases) {
    if (c.name != "force / 8" && c.name != "profile angle" && c.name != "modes x15") {
      EXPECT_LT(c.metrics.closed.all, 0.045e-3) << c.name;
    }
  }
}

TEST(RobustnessProperty, MonteCarloDoesNotDependOnThreadsAndGrowsWithUncertainty) {
  const rig::RigParameters rig;
  IdentifiedModel model = identified_model(rig);
  // sd 1 % of k1, 10 % of k2, 20 % of c, 5 um of eps, correlated k1-k2.
  const double sd[5] = {58, 1e6, 0.2, 5e-6, 5e-6};
  model.rotor_covariance.assign(25, 0);
  for (std::size_t i = 0; i < 5; ++i) model.rotor_covariance[6 * i] = sd[i] * sd[i];
  model.rotor_covariance[1] = model.rotor_covariance[5] = -0.9 * sd[0] * sd[1];
  const ControllerDesign d = good_design(rig, model);
  MonteCarloOptions o;
  o.samples = 12;
  o.threads = 1;
  const MonteCarloResult one = monte_carlo(d, model, data_sheet(rig), o);
  o.threads = 4;
  const MonteCarloResult four = monte_carlo(d, model, data_sheet(rig), o);
  for (std::size_t i = 0; i < one.samples.size(); ++i) EXPECT_EQ(one.samples[i].peak, four.samples[i].peak);
  EXPECT_EQ(one.stable.count, 12);
  // Clopper-Pearson for 12 of 12: 0.025^(1/12).
  EXPECT_NEAR(one.stable.low, std::pow(0.025, 1.0 / 12), 1e-9);
  EXPECT_EQ(one.stable.high, 1);
  EXPECT_LE(one.peak_median, one.peak_p95);
  EXPECT_LE(one.peak_p95, one.peak_worst);
  // The draws have the spread asked for and keep the correlation.
  double k1 = 0, product = 0;
  for (const auto& s : one.samples) k1 += std::pow(s.model.k1 - model.rotor->k1, 2) / 12;
  EXPECT_NEAR(std::sqrt(k1) / model.rotor->k1, 0.051, 0.035);
  o.stiffness_sd = 0;
  for (const auto& s : monte_carlo(d, model, data_sheet(rig), o).samples) {
    product += (s.model.k1 - model.rotor->k1) * (s.model.k2 - model.rotor->k2) / 12;
  }
  EXPECT_NEAR(product / (sd[0] * sd[1]), -0.9, 0.8);
  o.seed = 2;
  EXPECT_NE(monte_carlo(d, model, data_sheet(rig), o).samples[0].peak, one.samples[0].peak);
}

// The interval is the exact one: at its ends the tail of the binomial distribution holds 2.5 %.
TEST(ProportionReference, ClopperPearsonEndsHoldTheTails) {
  for (const auto& [k, n] : {std::pair{0L, 20L}, {1L, 20L}, {7L, 20L}, {20L, 20L}, {3L, 1000L}}) {
    const Proportion p = proportion(k, n);
    const auto tail = [&, kk = k, nn = n](double q, bool upper) {
      double sum = 0;
      for (long i = upper ? kk : 0; i <= (upper ? nn : kk); ++i) {
        const double x = static_cast<double>(i), m = static_cast<double>(nn);
        sum += std::exp(std::lgamma(m + 1) - std::lgamma(x + 1) - std::lgamma(m - x + 1) + x * std::log(q) +
                        (m - x) * std::log1p(-q));
      }
      return sum;
    };
    EXPECT_LE(p.low, p.value);
    EXPECT_GE(p.high, p.value);
    if (k > 0) {
      EXPECT_NEAR(tail(p.low, true), 0.025, 1e-9) << k;
    }
    if (k < n) {
      EXPECT_NEAR(tail(p.high, false), 0.025, 1e-9) << k;
    }
  }
  EXPECT_NEAR(proportion(0, 20).high, 1 - std::pow(0.025, 1.0 / 20), 1e-12);
}

ClosedLoopMetrics run_alone(const DrawnRig& drawn, const ControllerDesign& d) {
  ClosedLoopOptions options;
  options.run.seed = drawn.noise_seed;
  return ClosedLoopPlant(drawn.rig, options).run(d);
}

// By the force that acts: of a noisy command most stays within the play of an amplifier. Judged by the command,
// machines of a make with hysteresis chattered that alone do not.
TEST(MonteCarloProperty, LanesAreJudgedAsMachinesAlone) {
  rig::RigParameters rig;
  rig.actuator.hysteresis = 1;
  const IdentifiedModel model = identified_model(rig);
  const ControllerDesign d = good_design(rig, model);
  const Hardware hardware = data_sheet(rig);
  const RigDraw draw(d.model, model, tuning_hardware(d, hardware), MonteCarloOptions(), {});
  const MachineLanes<8> lanes(draw, {0, 1, 2, 3, 4, 5, 6, 7}, rig::make_rig_tables(draw(0).rig));
  const std::vector<LaneRun> runs = lanes.run(d);
  for (int i = 0; i < 8; ++i) {
    const double alone = run_alone(draw(i), d).total_variation;
    EXPECT_NEAR(runs[static_cast<std::size_t>(i)].judged.total_variation, alone, 1e-3 * alone);
  }
}

// Low-pass and play of the sensors, lag, limits and play of the actuators: every machine has its own, about those of
// the data sheet, and side by side they run as alone. What no sheet states stays away.
TEST(MonteCarloProperty, SensorsAndActuatorsOfTheMachinesDiffer) {
  rig::RigParameters rig;
  rig.laser.bandwidth = 60, rig.laser.hysteresis = 2e-6;
  rig.actuator.hysteresis = 0.5, rig.actuator.slew = 6000;
  rig.actuator.current_limit = 10, rig.actuator.force_per_ampere = 3;
  const IdentifiedModel model = identified_model(rig);
  const ControllerDesign d = good_design(rig, model);
  const Hardware hardware = tuning_hardware(d, data_sheet(rig));
  const auto numbers = [](const rig::RigParameters& r) {
    return std::array{r.laser.bandwidth, r.laser.hysteresis,    r.actuator.bandwidth,
                      r.actuator.slew,   r.actuator.hysteresis, r.actuator.current_limit};
  };
  const auto stated = numbers(rig);
  const RigDraw draw(d.model, model, hardware, MonteCarloOptions(), {});
  std::array<double, 6> mean{}, square{};
  constexpr int kMachines = 400;
  for (int i = 0; i < kMachines; ++i) {
    const auto own = numbers(draw(i).rig);
    for (std::size_t k = 0; k < own.size(); ++k) {
      const double ratio = own[k] / stated[k];
      EXPECT_GT(ratio, 0.5);
      mean[k] += ratio / kMachines, square[k] += ratio * ratio / kMachines;
    }
  }
  for (std::size_t k = 0; k < mean.size(); ++k) {
    EXPECT_NEAR(mean[k], 1, 0.02) << k;
    EXPECT_NEAR(std::sqrt(square[k] - mean[k] * mean[k]), 0.1, 0.015) << k;
  }
  const MachineLanes<8> lanes(draw, {0, 1, 2, 3, 4, 5, 6, 7}, rig::make_rig_tables(draw(0).rig));
  const std::vector<LaneRun> runs = lanes.run(d);
  for (int i = 0; i < 8; ++i) {
    const double alone = run_alone(draw(i), d).closed.all;
    EXPECT_NEAR(runs[static_cast<std::size_t>(i)].judged.closed.all, alone, 1e-3 * alone) << i;
  }
  MonteCarloOptions exact;
  exact.sheet_sd = 0;
  EXPECT_EQ(numbers(RigDraw(d.model, model, hardware, exact, {})(3).rig), stated);
  const rig::RigParameters plain;  // its data sheet states a bandwidth alone
  const rig::RigParameters own = RigDraw(d.model, model, data_sheet(plain), MonteCarloOptions(), {})(3).rig;
  EXPECT_EQ(own.laser.bandwidth, 0);
  EXPECT_EQ(own.actuator.slew, 0);
  EXPECT_NE(own.actuator.bandwidth, plain.actuator.bandwidth);
}

TEST(MonteCarloProperty, LanesEqualTheScalarLoopAndEachOther) {
  const rig::RigParameters rig;
  IdentifiedModel model = identified_model(rig);
  const ControllerDesign d = good_design(rig, model);
  MonteCarloOptions o;
  o.samples = 9;
  o.lanes = 8;
  o.limit = 20e-6;
  const MonteCarloResult eight = monte_carlo(d, model, data_sheet(rig), o);
  o.lanes = 16;
  const MonteCarloResult sixteen = monte_carlo(d, model, data_sheet(rig), o);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(eight.samples[i].peak, sixteen.samples[i].peak) << i;
    EXPECT_EQ(eight.samples[i].open_peak, sixteen.samples[i].open_peak) << i;
  }
  // No tolerances: sample 0 is the tuning plant with other runout phases and noise, so that its open loop is that of
  // the scalar rig.
  o.stiffness_sd = o.damping_sd = o.unbalance_sd = o.gain_sd = o.rotation_sd = 0;
  o.runout_sd = o.runout_common = o.participation_sd = o.ringing = o.sheet_sd = 0;
  o.samples = 1;
  const MonteCarloResult exact = monte_carlo(d, model, data_sheet(rig), o);
  const ClosedLoopPlant plant(tuning_plant(*model.rotor, data_sheet(rig)));
  EXPECT_NEAR(exact.samples[0].open_peak, plant.open().all, 1e-9);
  EXPECT_NEAR(exact.samples[0].peak, plant.run(d).closed.all, 10e-6);  // other runout phases and noise
  long exceeds = 0;
  for (const auto& s : eight.samples) exceeds += s.peak > 20e-6 || !s.stable;
  EXPECT_EQ(eight.exceeds.count, exceeds);
  o.lanes = 4;
  EXPECT_THROW(monte_carlo(d, model, data_sheet(rig), o), Error);
}

// What no data sheet says widens the interval by the difference it makes, and only by that.
TEST(MonteCarloProperty, WhatAllMachinesMayHaveInCommonWidensTheInterval) {
  const rig::RigParameters rig;
  const IdentifiedModel model = identified_model(rig);
  const ControllerDesign d = good_design(rig, model);
  MonteCarloOptions o;
  o.samples = 48;
  o.runout_sd = o.runout_common = 0;
  Hardware h = data_sheet(rig);
  o.limit = monte_carlo(d, model, h, o).peak_median;
  const auto runout = static_cast<std::size_t>(CommonUnknown::runout);
  const MonteCarloResult measured = monte_carlo(d, model, h, o);
  o.runout_common = 0.5;
  const MonteCarloResult unknown = monte_carlo(d, model, h, o);
  EXPECT_LT(measured.common[runout], 0.2);
  EXPECT_GT(unknown.common[runout], 0.3);  // the disk follows the runout: nearly none above with less, all with more
  for (const MonteCarloResult* r : {&measured, &unknown}) {
    const Proportion exact = proportion(r->exceeds.count, r->exceeds.n);
    const double all = r->common[0] + r->common[1] + r->common[2];
    EXPECT_DOUBLE_EQ(r->exceeds.low, std::max(exact.low - all, 0.0));
    EXPECT_DOUBLE_EQ(r->exceeds.high, std::min(exact.high + all, 1.0));
  }
  // Half of the samples each way, whatever the other unknowns do.
  for (const CommonUnknown u : {CommonUnknown::distribution, CommonUnknown::runout, CommonUnknown::ringing}) {
    int count = 0;
    for (int i = 0; i < 48; ++i) count += common_case(u, i);
    EXPECT_EQ(count, 24);
  }
}

TEST(RobustnessUnit, BadCovarianceIsRefused) {
  const rig::RigParameters rig;
  IdentifiedModel model = identified_model(rig);
  const ControllerDesign d = good_design(rig, model);
  MonteCarloOptions o;
  o.samples = 1;
  model.rotor_covariance.assign(9, 1);
  EXPECT_THROW(monte_carlo(d, model, data_sheet(rig), o), Error);
  model.rotor_covariance.assign(25, 0);
  model.rotor_covariance[0] = model.rotor_covariance[6] = 1;
  model.rotor_covariance[1] = model.rotor_covariance[5] = 2;
  EXPECT_THROW(monte_carlo(d, model, data_sheet(rig), o), Error);
  model.rotor.reset();
  EXPECT_THROW(monte_carlo(d, model, data_sheet(rig), o), Error);
}

TEST(CompareE2e, SameBudgetAndSeedsForEveryMethod) {
  const rig::RigParameters rig;
  CompareOptions o;
  o.methods = {{"pd", "lpf", true, {}}, {"pd_notch", "lpf", false, {}}, {"pd", "kfe", true, {}}};
  o.design.hardware = data_sheet(rig);
  o.design.evaluations = 6;
  o.seeds = {101, 102};
  o.matrix = false;
  rig::RigParameters balanced = rig;
  balanced.rotor.added_mass = 0;
  o.balanced_eps = 0.96 * balanced.eccentricity();
  double done = 0;
  o.progress = [&](const std::string& label, double fraction) {
    EXPECT_FALSE(label.empty());
    EXPECT_GT(fraction, done);
    done = fraction;
  };
  const auto results = compare(identified_model(rig), rig, o);
  ASSERT_EQ(results.size(), 3u);
  EXPECT_EQ(done, 1);
  EXPECT_EQ(results[1].label, "pd_notch, lpf, no feedforward");
  EXPECT_EQ(best_result(results).label, results[2].label);
  for (const auto& r : results) {
    EXPECT_GE(r.peak_worst, r.peak_mean);
    EXPECT_GT(r.peak_mean, 0);
    ASSERT_TRUE(r.balanced);
    EXPECT_GT(r.nominal.suppression.all, 0.5) << r.label;
  }
  // The observer with eccentricity states beats the direct PD whatever the small budget.
  EXPECT_LT(results[2].peak_mean, results[0].peak_mean);
}

TEST(CompareE2e, FloorTakesOneImperfectionAtATime) {
  const rig::RigParameters rig;
  const auto floor = physical_floor(good_design(rig, identified_model(rig)), rig);
  const auto peak = [&](const char* start) {
    for (const FloorCase& f : floor) {
      if (f.name.starts_with(start)) return f.peak;
    }
    return std::nan("");
  };
  // The disk follows minus the runout (12 + 5 + 3 um at most) that the sensors report; noise of 0.7 um leaves little.
  EXPECT_NEAR(peak("runout, not removed"), 18e-6, 4e-6);
  EXPECT_LT(peak("sensor noise"), 5e-6);
  EXPECT_LE(peak("nothing"), peak("all of it"));
}

}  // namespace
}  // namespace whirl::tuning
