#include <gtest/gtest.h>

#include "monte_carlo/training.hpp"
#include "rig_design.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/method.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {
namespace {

DesignOptions options_of(const rig::RigParameters& rig, int threads) {
  DesignOptions o;
  o.law = "learned";
  o.estimator = "lpf";
  o.feedforward = false;
  o.hardware = data_sheet(rig);
  o.hardware.profile.ramp_time = 6;
  o.evaluations = 3;
  o.inputs.training_runs = 500;
  o.threads = threads;
  return o;
}

// What the training says it gained is gained on machines it has never seen.
TEST(LearnedE2e, TrainingGainsOnMachinesItHasNotSeenAndKeepsToItsBudget) {
  const rig::RigParameters rig;
  const IdentifiedModel model = true_model(rig);
  DesignOptions o = options_of(rig, 0);
  o.fixed["gain_im_0"] = 0.9;
  const ControllerDesign d = design(model, o);
  EXPECT_GT(d.margins.at("training_runs"), 300);
  EXPECT_LE(d.margins.at("training_runs"), 500);
  ASSERT_LT(d.margins.at("training_cost"), d.margins.at("training_start"));
  EXPECT_EQ(d.parameters.at("gain_im_0"), 0.9);
  // The machines of `robustness`: another seed, other lanes, other measure.
  MonteCarloOptions study;
  study.samples = 32;
  study.seed = 4711;
  const MonteCarloResult trained = monte_carlo(d, model, o.hardware, study);
  EXPECT_EQ(trained.stable.count, 32);
  ControllerDesign start = d;
  for (const std::string& w : control::law_entry("learned").weights) start.parameters.erase(w);
  EXPECT_LT(trained.peak_median, monte_carlo(start, model, o.hardware, study).peak_median);
}

TEST(LearnedProperty, TheWeightsDoNotDependOnTheNumberOfThreads) {
  const rig::RigParameters rig;
  DesignOptions alone = options_of(rig, 1), three_threads = options_of(rig, 3);
  for (DesignOptions* o : {&alone, &three_threads}) o->evaluations = 1, o->inputs.training_runs = 300;
  const ControllerDesign one = design(true_model(rig), alone), three = design(true_model(rig), three_threads);
  EXPECT_EQ(one.parameters, three.parameters);
}

}  // namespace
}  // namespace whirl::tuning
