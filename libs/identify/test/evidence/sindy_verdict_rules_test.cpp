// The verdict on equations by itself: records, fit and rivals are written down here.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "evidence/sindy_verdict.hpp"
#include "rules/rules.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification {
namespace {

using detail::Followed;
using detail::OutputWeights;
using detail::SindyData;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kStep = 0.01;

/// A free oscillation of 1 Hz in x, its rate in v, and noise of this size on both.
Recording oscillation(double amplitude, double seconds, double noise, unsigned seed = 1) {
  std::mt19937 random(seed);
  const auto n = static_cast<Eigen::Index>(std::lround(seconds / kStep));
  const double omega = 2 * std::numbers::pi;
  Eigen::VectorXd x(n), v(n);
  const auto drawn = [&] { return noise * (std::generate_canonical<double, 53>(random) - 0.5); };
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = kStep * static_cast<double>(i);
    x[i] = amplitude * std::cos(omega * t) + drawn();
    v[i] = -amplitude * std::sin(omega * t) + drawn();
  }
  Recording r;
  r.dt = kStep;
  r.add("x", Quantity::dimensionless, x);
  r.add("v", Quantity::dimensionless, v);
  return r;
}

SindyData data_of(const std::vector<Recording>& records, std::vector<std::string> library = {}) {
  SindyOptions options;
  options.states = {"x", "v"};
  options.library = std::move(library);
  SindyData data(options);
  data.add(records, 1000000);
  return data;
}

std::string all_warnings(const IdentifiedModel& model) {
  std::string text;
  for (const std::string& warning : model.summary.warnings) text += warning + "\n";
  return text;
}

/// Of free runs whose residuals are so large, in units of the noise.
struct JudgedSindy {
  std::vector<Recording> records = {oscillation(2, 20, 1e-3)};
  OutputWeights weights{Eigen::Vector2d(0.1, 0.2), true, {}};
  Followed followed;
  double chi_square = 1;
  IdentifiedModel model;
  std::string run(std::vector<std::string> library = {}) {
    const SindyData data = data_of(records, std::move(library));
    model = {};
    model.summary.chi_square = chi_square;
    if (followed.output_rmse.size() == 0) followed.output_rmse = Eigen::Vector2d(1, 1);
    detail::judge_refined(data, weights, followed, {"v'", 0.07}, model);
    return all_warnings(model);
  }
};
JudgedSindy following(double x, double v) {
  JudgedSindy j;
  j.followed.horizon = 5;
  j.followed.output_rmse = Eigen::Vector2d(x, v);
  return j;
}

// Noise below a millionth of the signal is the error of the samples.
TEST(SystemVerdictRules, TheLeastWeightIsAMillionthOfTheSignal) {
  const std::vector<Recording> still = {oscillation(2, 10, 0), oscillation(1, 20, 0)};
  SindyData data = data_of(still);
  double squares = 0, rows = 0;
  for (const auto& s : data.stretches())
    squares += s.raw.col(0).squaredNorm(), rows += static_cast<double>(s.samples());
  const OutputWeights exact = detail::output_weights(data);
  const double floor = 1e-6 * std::sqrt(squares / rows);
  if (data.noise_sd()[0] < floor) {
    EXPECT_FALSE(exact.noisy);
    EXPECT_NEAR(exact.sd[0], floor, 1e-12 * floor);
  }
  EXPECT_GE(exact.sd[0], floor);
  EXPECT_GE(exact.sd[0], data.noise_sd()[0]);
  const SindyData noisy = data_of({oscillation(2, 10, 0.1)});
  const OutputWeights weights = detail::output_weights(noisy);
  EXPECT_TRUE(weights.noisy);
  EXPECT_EQ(weights.sd, noisy.noise_sd());
}

// Of correlated noise counts what is new in every sample, over all records.
TEST(SystemVerdictRules, CorrelatedNoiseIsWeighedByItsInnovation) {
  const SindyData data = data_of({oscillation(2, 10, 0.1, 1), oscillation(1, 20, 0.3, 2)});
  const OutputWeights weights = detail::output_weights(data, Eigen::Vector2d(0.5, 0));
  double squares = 0, rows = 0;
  for (const auto& s : data.stretches()) {
    squares += static_cast<double>(s.samples()) * std::pow(signal::innovation_sd(s.raw.col(0), 0.5), 2);
    rows += static_cast<double>(s.samples());
  }
  EXPECT_NEAR(weights.sd[0], std::sqrt(squares / rows), 1e-12);
  EXPECT_EQ(weights.sd[1], data.noise_sd()[1]);
}

TEST(SystemVerdictRules, WhatFreeRunsLeaveIsComparedWithTheMotion) {
  // Residuals of 3 and 2 times the noise of 0.1 and 0.2 on two oscillations: what is beyond the noise, over the
  // deviation of each state from its mean, mean of both states.
  JudgedSindy j = following(3, 2);
  j.records = {oscillation(2, 20, 0, 1), oscillation(4, 10, 0, 2)};
  const double motion = (2000 * 2.0 * 2 / 2 + 1000 * 4.0 * 4 / 2) / 3000;
  const auto left = [&](double correlation) {
    const double a = 0.1 / (1 - correlation), b = 0.2;
    return std::sqrt((8 * a * a + 3 * b * b) / motion / 2);
  };
  EXPECT_THAT(j.run(), HasSubstr(fmt::format("leave {:.0f} %", 100 * left(0))));
  EXPECT_EQ(j.model.summary.status, Status::unusable);
  j.weights.correlation = Eigen::Vector2d(0.5, 0);
  EXPECT_THAT(j.run(), HasSubstr(fmt::format("leave {:.0f} %", 100 * left(0.5))));
  j.weights.correlation = {};
  j.weights.sd *= 0.1;
  EXPECT_THAT(j.run(), HasSubstr(fmt::format("{:.2g} % of the motion unexplained", 10 * left(0))));
  EXPECT_EQ(j.model.summary.status, Status::warning);
  // The mean of a state is no motion.
  for (Recording& r : j.records) {
    Recording moved;
    moved.dt = r.dt;
    moved.add("x", Quantity::dimensionless, r["x"].array() + 50);
    moved.add("v", Quantity::dimensionless, r["v"]);
    r = moved;
  }
  EXPECT_THAT(j.run(), HasSubstr(fmt::format("{:.2g} % of the motion unexplained", 10 * left(0))));
}

TEST(SystemVerdictRules, TheWorseOfTheFitAndItsWorstStateIsTheChiSquare) {
  JudgedSindy j = following(1, 1);
  EXPECT_EQ(j.run(), "");
  EXPECT_EQ(j.model.summary.status, Status::ok);
  j.weights.sd *= 0.01;
  j.followed.output_rmse[1] = 1.5;  // 2.25 of its noise
  EXPECT_THAT(j.run(), HasSubstr("2.25"));
  j.followed.output_rmse[1] = 0.5;
  j.chi_square = 3;
  EXPECT_THAT(j.run(), HasSubstr("3"));
  EXPECT_EQ(j.model.summary.status, Status::warning);
}

TEST(SystemVerdictRules, RunsThatAreShortAreNoModel) {
  JudgedSindy j = following(1, 1);
  j.followed.horizon = 0;
  EXPECT_THAT(j.run(), HasSubstr("diverge at once"));
  EXPECT_THAT(all_warnings(j.model), HasSubstr("least explained is v' (7 % left)"));
  j.followed.horizon = 0.23;
  EXPECT_THAT(j.run(), HasSubstr("for 0.23 s only, 0.23 of a characteristic period"));
  j.followed.horizon = 0.25;
  EXPECT_EQ(j.run(), "");
}

TEST(SystemVerdictRules, CandidatesThatEndAtSquaresAreSaid) {
  JudgedSindy j = following(1, 1);
  j.followed.horizon = 0;
  EXPECT_THAT(j.run(), Not(HasSubstr("no term of degree 3")));
  EXPECT_THAT(j.run({"x", "v", "x^2"}), HasSubstr("no term of degree 3"));
  EXPECT_THAT(j.run({"x", "v", "x^2*v"}), Not(HasSubstr("no term of degree 3")));
}

// Without noise the steps of the integration are the limit: finer where there are no inputs.
TEST(SystemVerdictRules, WithoutNoiseTheErrorOfTheStepsIsTheLimit) {
  for (const bool input : {false, true}) {
    for (const double times : {0.9, 1.1}) {
      JudgedSindy j = following(1, 1);
      j.weights.noisy = false;
      const double limit = input ? 3e-4 : 3e-5, motion = 2;  // 2^2 / 2
      // Both states leave `times` of the limit: rmse^2 - 1 = 1 with such a weight.
      j.followed.output_rmse = Eigen::Vector2d::Constant(std::sqrt(2.0));
      j.weights.sd = Eigen::Vector2d::Constant(times * limit * std::sqrt(motion));
      const SindyData data = data_of(j.records);
      j.model.summary.chi_square = 1;
      if (input) j.model.inputs = {"u"};
      detail::judge_refined(data, j.weights, j.followed, {}, j.model);
      EXPECT_EQ(all_warnings(j.model).find("model error") != std::string::npos, times > 1) << input << " " << times;
      EXPECT_TRUE(std::isnan(j.model.summary.chi_square));
    }
  }
}

// Of six radians of the characteristic rate on, which is nearly a period.
TEST(SystemVerdictRules, ShortRecordsAreSaid) {
  int said = 0, silent = 0;
  for (const double seconds : {0.4, 0.6, 0.8, 0.9, 1.0, 1.2, 1.4}) {
    JudgedSindy j = following(1, 1);
    j.followed.horizon = 0.35;
    j.records = {oscillation(2, seconds, 1e-3), oscillation(2, 0.3, 1e-3)};
    const double turns = data_of(j.records).rate() * seconds;
    const std::string text =
        fmt::format("the longest record holds {:.2g} characteristic periods", turns / (2 * std::numbers::pi));
    EXPECT_EQ(j.run().find(text) != std::string::npos, turns < 6) << seconds << ": " << turns;
    ++(turns < 6 ? said : silent);
  }
  EXPECT_GT(said, 0);
  EXPECT_GT(silent, 0);
}

TEST(SystemVerdictRules, TermsThatTheRecordsCannotTellApartAreNamedOnceAnEquation) {
  Equation other;
  other.lhs = "v'";
  const auto term = [](const char* function, double value) {
    EquationTerm t;
    t.function = function;
    t.coefficient.value = value;
    return t;
  };
  other.terms = {term("x", -39.5), term("1", -2), term("v", 0.25)};
  JudgedSindy j = following(1, 1);
  j.followed.rivals = {{other, 1.44}};
  const std::string one = j.run();
  EXPECT_THAT(one, HasSubstr("v' = -39.5 x - 2 + 0.25 v explains them as well (chi-square 1.44, this model 1);"));
  EXPECT_THAT(j.model.summary.trust, HasSubstr("along motions like those recorded"));
  EXPECT_THAT(j.model.summary.trust, HasSubstr("beyond them"));
  other.terms = {term("x", 3)};
  j.followed.rivals.push_back({other, 1.69});
  const std::string two = j.run();
  EXPECT_THAT(two, HasSubstr("this model 1), and so do 1 more;"));
  EXPECT_THAT(two, Not(HasSubstr("v' = 3 x")));
  j.weights.noisy = false;
  EXPECT_THAT(j.run(), HasSubstr("its error is 1.2 times this model's"));
  j.followed.rivals.clear();
  j.run();
  EXPECT_THAT(j.model.summary.trust, HasSubstr("in the range of the records"));
}

TEST(SystemVerdictRules, TheRangeOfEveryStateOverAllRecordsIsTrusted) {
  JudgedSindy j = following(1, 1);
  j.records = {oscillation(2, 10, 0), oscillation(5, 20, 0)};
  j.run();
  EXPECT_THAT(j.model.summary.trust, HasSubstr("Trust free runs of up to 5 s"));
  EXPECT_THAT(j.model.summary.trust, HasSubstr("(x from -5 to 5, v from -5 to 5)"));
  j.followed.horizon = 100;
  j.run();
  EXPECT_THAT(j.model.summary.trust, HasSubstr("of up to 20 s"));
}

TEST(SystemVerdictRules, RegressionsAreJudgedByWhatTheyLeave) {
  const SindyData data = data_of({oscillation(2, 10, 0)});
  const auto judged = [&](double residual) {
    IdentifiedModel model;
    model.summary.residual = residual;
    detail::judge_regression(data, model);
    return model.summary.status;
  };
  EXPECT_EQ(judged(0.99 * rules::kRegressionPoor.limit), Status::ok);
  EXPECT_EQ(judged(1.01 * rules::kRegressionPoor.limit), Status::warning);
  EXPECT_EQ(judged(1.01 * rules::kLost.limit), Status::unusable);
  EXPECT_EQ(judged(std::nan("")), Status::unusable);
}

}  // namespace
}  // namespace whirl::identification
