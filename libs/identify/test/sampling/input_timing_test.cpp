#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/identify/trajectory.hpp"
#include "whirl/testing/held_input.hpp"

namespace whirl::identification {
namespace {

SindyOptions options_of(const testing::HeldSystem& system) {
  SindyOptions o;
  o.states = system.states;
  o.inputs = {"u"};
  o.library = system.library;
  return o;
}

class HeldInputProperty : public ::testing::TestWithParam<int> {};

// Free runs of another record, from 1 % noise, stay within 1.2 times the noise floor for any dead time.
TEST_P(HeldInputProperty, FreeRunReachesNoiseFloor) {
  const testing::HeldSystem system = testing::held_systems()[static_cast<std::size_t>(GetParam())];
  const double dead[] = {1.37, 0, 2.8};
  const double d = dead[GetParam()] * system.dt;
  const Recording train = testing::held_record(system, d, 1500, 0.01, 11);
  const Recording other = testing::held_record(system, d, 1000, 0.01, 12);
  const IdentifiedModel model = fit_sindy({train}, options_of(system));
  ASSERT_NE(model.summary.status, Status::unusable) << model.summary.warnings.back();
  ASSERT_EQ(model.timing.size(), 1u);
  EXPECT_EQ(model.timing[0].hold, Hold::zero);
  EXPECT_NEAR(model.timing[0].dead_time.value, d, std::max(0.02 * system.dt, 4 * model.timing[0].dead_time.sd));
  for (const StateScore& s : score(model, other)) {
    const Eigen::VectorXd& y = other[s.state];
    const double noise = 0.01 * std::sqrt((y.array() - y.mean()).square().mean());
    EXPECT_LT(s.rmse, 1.2 * noise) << system.name << " " << s.state;
  }
}

// A gap in all channels and an empty last line, as loggers leave them, hide neither the hold nor the dead time.
TEST(InputTimingProperty, GapsHideNoDeadTime) {
  const testing::HeldSystem system = testing::held_systems()[2];
  const double d = 2.8 * system.dt;
  Recording train = testing::held_record(system, d, 1500, 0.01, 41);
  for (Channel& c : train.channels) {
    c.samples.segment(620, 12).setConstant(std::numeric_limits<double>::quiet_NaN());
    c.samples.tail(3).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  IdentifyOptions options;
  options.method = Method::sindy;
  options.holdout = 0;
  options.sindy = options_of(system);
  const IdentifiedModel model = identify(train, options).model;
  ASSERT_NE(model.summary.status, Status::unusable) << model.summary.warnings.back();
  ASSERT_EQ(model.timing.size(), 1u);
  EXPECT_EQ(model.timing[0].hold, Hold::zero);
  EXPECT_NEAR(model.timing[0].dead_time.value, d, std::max(0.02 * system.dt, 4 * model.timing[0].dead_time.sd));
}

/// Largest error of a free run of another record by the noise that was added to it.
double times_noise(const IdentifiedModel& model, const Recording& other) {
  double worst = 0;
  for (const StateScore& s : score(model, other)) {
    const Eigen::VectorXd& y = other[s.state];
    worst = std::max(worst, s.rmse / (0.01 * std::sqrt((y.array() - y.mean()).square().mean())));
  }
  return worst;
}

// Straight lines from sample to sample, with little and with more dead time.
TEST_P(HeldInputProperty, StraightLinesBetweenSamplesAreFound) {
  const testing::HeldSystem system = testing::held_systems()[static_cast<std::size_t>(GetParam())];
  const double dead[] = {0.12, 0.08, 2.2};
  const double d = dead[GetParam()] * system.dt;
  const testing::Actuator lines{true, 0};
  const IdentifiedModel model = fit_sindy({testing::held_record(system, d, 1500, 0.01, 61, lines)}, options_of(system));
  EXPECT_LT(times_noise(model, testing::held_record(system, d, 1000, 0.01, 62, lines)), 1.2) << system.name;
}

// A D/A converter, a dead time and an actuator that lags by two samples: all three are found.
TEST_P(HeldInputProperty, LaggingActuatorBehindHoldIsFound) {
  const testing::HeldSystem system = testing::held_systems()[static_cast<std::size_t>(GetParam())];
  const double dead[] = {0.6, 1.37, 0};
  const double d = dead[GetParam()] * system.dt;
  const testing::Actuator slow{false, 2 * system.dt};
  const IdentifiedModel model = fit_sindy({testing::held_record(system, d, 1500, 0.01, 71, slow)}, options_of(system));
  EXPECT_EQ(model.summary.status, Status::ok);
  ASSERT_EQ(model.states.size(), system.states.size() + 1) << system.name;
  ASSERT_EQ(model.timing.size(), 1u);
  EXPECT_NEAR(model.timing[0].dead_time.value, d, 0.1 * system.dt);
  EXPECT_NEAR(model.equations.back().terms[0].coefficient.value, 0.5 / system.dt, 0.05 / system.dt);
  EXPECT_LT(times_noise(model, testing::held_record(system, d, 1000, 0.01, 72, slow)), 1.2) << system.name;
}

// A valve moves a mass on a column of oil: 7.5 samples a period. One Runge-Kutta step a sample damps that by itself.
TEST(InputTiming, FastOscillationKeepsItsDamping) {
  testing::HeldSystem oil;
  oil.name = "oil column";
  oil.states = {"v", "p"};
  oil.rates = [](const std::vector<double>& x, double u) {
    return std::vector<double>{-20 * x[0] + 50 * x[1], -14000 * x[0] - 60 * x[1] + 1400 * u};
  };
  oil.dt = 0.001;
  oil.amplitude = 1;
  oil.steps_a_level = 10;
  const IdentifiedModel model = fit_sindy({testing::held_record(oil, 0, 2000, 0.01, 81)}, options_of(oil));
  for (const auto& [name, value] :
       {std::pair("v': v", -20.0), {"v': p", 50.0}, {"p': v", -14000.0}, {"p': p", -60.0}}) {
    const Estimate* e = model.parameter(name);
    ASSERT_NE(e, nullptr) << name;
    EXPECT_LT(std::abs(e->value - value), 4 * e->sd) << name << " " << e->value << " +- " << e->sd;
  }
}

// The record does not tell which, then it is the D/A converter.
TEST(InputTiming, StepsRatherThanLinesWhereBothReadAlike) {
  const testing::HeldSystem system = testing::held_systems()[1];
  const double d = 1.47 * system.dt;
  const IdentifiedModel model = fit_sindy({testing::held_record(system, d, 1500, 0.01, 104)}, options_of(system));
  ASSERT_EQ(model.timing.size(), 1u);
  EXPECT_EQ(model.timing[0].hold, Hold::zero);
  EXPECT_NEAR(model.timing[0].dead_time.value, d, 0.02 * system.dt);
  EXPECT_NE(model.summary.trust.find("do not tell steps"), std::string::npos) << model.summary.trust;
}

INSTANTIATE_TEST_SUITE_P(Systems, HeldInputProperty, ::testing::Values(0, 1, 2));

// The derivative of the free run with respect to a dead time, at switches and between them, against differences.
TEST(TrajectoryConvergence, DeadTimeIsFoundFromAnywhere) {
  const testing::HeldSystem system = testing::held_systems()[1];
  const Recording r = testing::held_record(system, 1.6 * system.dt, 400, 0, 3);
  IdentifiedModel truth;
  truth.states = {"x", "v"};
  truth.inputs = {"u"};
  truth.equations = {{"x'", {{"v", {1, 0, 1, 1}, ""}}},
                     {"v'", {{"x", {-9}, ""}, {"x^3", {-14}, ""}, {"v", {-0.7}, ""}, {"u", {12}, ""}}}};
  for (const double start : {0.2, 1.0, 2.5}) {
    truth.timing = {{"u", Hold::zero, {start * system.dt}}};
    TrajectoryOptions o;
    o.free_dead_time = {"u"};
    const TrajectoryFit fit =
        fit_trajectory(trajectory_model(truth, {"x", "v"}), {r}, {{0, 0, r.size(), Eigen::Vector2d::Zero()}}, o);
    EXPECT_TRUE(fit.converged);
    EXPECT_NEAR(fit.model.timing[0].dead_time.value / system.dt, 1.6, 1e-4) << start;
    EXPECT_NEAR(fit.model.parameters[2].value, -14, 1e-2);
    EXPECT_LT(fit.iterations, 20);
  }
}

TEST(InputTiming, StaysAwayFromSmoothInputs) {
  testing::HeldSystem system = testing::held_systems()[1];
  Recording r = testing::held_record(system, 0, 1200, 0, 5);
  // The same system, driven by a smooth input without dead time.
  const double w = 2.2;
  std::vector<double> x{0, 0};
  for (Eigen::Index i = 0; i < r.size(); ++i) {
    r.channels[0].samples[i] = x[0];
    r.channels[1].samples[i] = x[1];
    r.channels[2].samples[i] = std::sin(w * system.dt * static_cast<double>(i));
    for (int j = 0; j < 200; ++j) {
      const double h = system.dt / 200, t = system.dt * (static_cast<double>(i) + (j + 0.5) / 200);
      const auto first = system.rates(x, std::sin(w * t));
      const auto slope = system.rates({x[0] + 0.5 * h * first[0], x[1] + 0.5 * h * first[1]}, std::sin(w * t));
      for (std::size_t k = 0; k < 2; ++k) x[k] += h * slope[k];
    }
  }
  const IdentifiedModel model = fit_sindy({r}, options_of(system));
  EXPECT_TRUE(model.timing.empty());
}

TEST(InputTiming, GivenHoldAndDeadTimeAreKept) {
  const testing::HeldSystem system = testing::held_systems()[2];
  SindyOptions o = options_of(system);
  o.timing.hold = {{"u", Hold::first}};
  o.timing.dead_time = {{"u", 0.03}};
  const IdentifiedModel model = fit_sindy({testing::held_record(system, 0.02, 600, 0.01, 4)}, o);
  ASSERT_EQ(model.timing.size(), 1u);
  EXPECT_EQ(model.timing[0].hold, Hold::first);
  EXPECT_DOUBLE_EQ(model.timing[0].dead_time.value, 0.03);
  o.timing.hold = {{"q", Hold::zero}};
  EXPECT_THROW(fit_sindy({testing::held_record(system, 0.02, 600, 0.01, 4)}, o), Error);
}

}  // namespace
}  // namespace whirl::identification
