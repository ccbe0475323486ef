// The verdict on a rotor by itself: records and fit are written down here.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "evidence/rotor_verdict.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kTwoPi = 2 * std::numbers::pi;

Estimate estimate(double value, double sd) { return {value, sd, value - 2 * sd, value + 2 * sd}; }

/// A rotor of 12 Hz, two records that pass it.
struct Judged {
  std::vector<RotorRecord> records;
  RotorIdentification result;
  Summary summary;

  Judged() {
    RotorModel rotor;
    rotor.k1 = std::pow(kTwoPi * 12, 2), rotor.c = 3;
    result.model.rotor = rotor;
    result.fit.model = rotor;
    result.model.quantity = Quantity::displacement;
    result.model.parameters = {{"k1", estimate(rotor.k1, 1)},
                               {"c", estimate(3, 0.1)},
                               {"k2", estimate(1e8, 1e6)},
                               {"e", estimate(1e-4, 1e-6)}};
    summary.chi_square = result.fit.summary.chi_square = 1;
    add(30, 2, 1e-3, 1000);
    add(25, 2.5, 2e-3, 3000);
  }
  void add(double from, double to, double amplitude, Eigen::Index samples) {
    RotorRecord r;
    r.source = fmt::format("run {}", records.size() + 1);
    r.dt = 1e-3;
    r.z = Eigen::VectorXcd::Constant(samples, amplitude);
    const double seconds = 1e-3 * static_cast<double>(samples - 1);
    r.angle = signal::angle_from_profile(0, kTwoPi * from, kTwoPi * (to - from) / seconds, 1e-3, samples);
    r.noise_x = r.noise_y = 1e-6;
    records.push_back(r);
    OutputErrorRecord f;
    f.angle = r.angle;
    f.main = r.z;
    f.rmse_x = f.rmse_y = 1e-6;
    result.fit.records.push_back(f);
  }
  Estimate& parameter(const std::string& name) {
    for (auto& [key, value] : result.model.parameters)
      if (key == name) return value;
    return result.model.parameters.emplace_back(name, Estimate()).second;
  }
  std::string run() {
    Summary s = summary;
    detail::judge_rotor(records, result, s);
    judged = s;
    std::string text;
    for (const std::string& warning : s.warnings) text += warning + "\n";
    return text;
  }
  Summary judged;
};

TEST(RotorVerdictRules, ASoundFitIsTrustedOverItsSpeedsAndAmplitudes) {
  Judged j;
  EXPECT_EQ(j.run(), "");
  EXPECT_EQ(j.judged.status, Status::ok);
  EXPECT_THAT(j.judged.trust, HasSubstr("from 2.0 to 30.0 Hz up to 2 mm (radius); c includes any cross-coupled"));
  EXPECT_NEAR(j.judged.residual, 1e-6, 1e-15) << "rms of every reading";
}

// What is beyond the noise of each record, over the motion of all.
TEST(RotorVerdictRules, WhatTheModelLeavesIsBeyondTheNoiseOverTheMotion) {
  Judged j;
  j.result.fit.records[0].rmse_x = 3e-4, j.result.fit.records[0].rmse_y = 4e-4;
  j.result.fit.records[1].rmse_x = j.result.fit.records[1].rmse_y = 0;  // less than its noise counts nothing
  j.records[0].noise_x = j.records[0].noise_y = 1e-4;
  j.records[1].noise_x = j.records[1].noise_y = 1e-3;
  const double excess = 1000 * (25e-8 - 2e-8), motion = 1000 * 1e-6 + 3000 * 4e-6;
  EXPECT_NEAR(std::sqrt(excess / motion), 0.133, 1e-3);
  EXPECT_EQ(j.run(), "");
  EXPECT_NEAR(j.judged.residual, std::sqrt(1000 * 25e-8 / 8000), 1e-12);
  j.result.fit.records[0].rmse_x = 5e-4;  // 17.3 %
  EXPECT_THAT(j.run(), HasSubstr("the model leaves 17 %"));
  EXPECT_EQ(j.judged.status, Status::unusable);
  // Of one axis half of the motion and half of the readings.
  for (RotorRecord& r : j.records) r.axes = Axes::x;
  j.result.fit.records[0].rmse_x = 2e-4, j.result.fit.records[0].rmse_y = 0;
  EXPECT_EQ(j.run(), "") << "sqrt((4e-8 - 1e-8) 1000 / 6.5e-3): 6.8 %";
  j.result.fit.records[0].rmse_x = 4e-4;
  EXPECT_THAT(j.run(), HasSubstr("the model leaves 15 %")) << "sqrt((16e-8 - 1e-8) 1000 / 6.5e-3): 15.2 %";
}

TEST(RotorVerdictRules, ParametersThatTheRecordsLeaveOpenAreSaid) {
  Judged j;
  const double k1 = j.parameter("k1").value;
  j.parameter("k1").sd = 0.99 * rules::kSpringOpen * k1;
  EXPECT_EQ(j.run(), "");
  j.parameter("k1").sd = 0.051 * k1;
  EXPECT_THAT(j.run(), HasSubstr("the stiffness is not determined by these records (+-10 %)"));
  EXPECT_EQ(j.judged.status, Status::unusable);
  j.parameter("k1").sd = 1;
  j.parameter("e").sd = 0.49e-4;
  EXPECT_EQ(j.run(), "");
  j.parameter("e").sd = 0.51e-4;
  EXPECT_THAT(j.run(), HasSubstr("the unbalance is not determined"));
  j.parameter("e").sd = 1e-6;
  j.parameter("c") = {0.1, 0.2, -0.3, 0.5};
  EXPECT_THAT(j.run(), HasSubstr("c between -0.3 and 0.5 1/s"));
  EXPECT_EQ(j.judged.status, Status::warning);
  j.parameter("c") = {-0.4, 0.1, -0.6, -0.2};
  EXPECT_THAT(j.run(), HasSubstr("the damping is negative"));
  EXPECT_EQ(j.judged.status, Status::unusable);
  j.parameter("c") = {0.4, 0.1, 0, 0.6};
  EXPECT_EQ(j.run(), "");
  j.parameter("k2") = {1e6, 2e6, -3e6, 5e6};
  EXPECT_THAT(j.run(), HasSubstr("not determined by an amplitude of 2 mm (k2 between -3e+06 and 5e+06"));
}

TEST(RotorVerdictRules, SpeedsThatWereNotPassedAreSaid) {
  Judged above;
  above.records.clear(), above.result.fit.records.clear();
  above.add(11.9, 2, 1e-3, 1000);
  EXPECT_THAT(above.run(),
              HasSubstr("the critical speed 12.00 Hz lies outside the speeds of the records, 2.0 to 11.9 Hz"));
  Judged below;
  below.records.clear(), below.result.fit.records.clear();
  below.add(30, 12.1, 1e-3, 1000);
  EXPECT_THAT(below.run(), HasSubstr("12.1 to 30.0 Hz"));
  EXPECT_THAT(below.run(), HasSubstr("the records do not go below 12.1 Hz: shaft runout cannot be distinguished"));
  Judged passed;
  passed.records.clear(), passed.result.fit.records.clear();
  passed.add(12.1, 2, 1e-3, 1000);
  EXPECT_EQ(passed.run(), "");
}

// 64 rad/s, as which the first speed is written without rounding.
TEST(RotorVerdictRules, ACriticalSpeedAtTheVeryEndIsPassed) {
  for (const double to : {200.0, 1.0}) {
    Judged j;
    j.result.model.rotor->k1 = 64 * 64;
    j.records.resize(1), j.result.fit.records.resize(1);
    j.records[0].angle = signal::angle_from_profile(0, 64, to - 64, 1e-3, 1000);
    EXPECT_THAT(j.run(), Not(HasSubstr("lies outside the speeds"))) << to;
  }
}

TEST(RotorVerdictRules, RunoutIsSeenNearStandstillOrEstimated) {
  for (const double lowest : {2.9, 3.1}) {  // a quarter of 12 Hz
    Judged j;
    j.records.clear(), j.result.fit.records.clear();
    j.add(30, lowest, 1e-3, 1000);
    EXPECT_EQ(j.run() != "", lowest > 3) << lowest;
    j.result.active.probes.runout_harmonics = 1;
    EXPECT_EQ(j.run(), "");
    j.result.active.probes.runout_harmonics = 0;
    j.result.model.quantity = Quantity::acceleration;
    EXPECT_EQ(j.run(), "") << "no probe";
  }
}

TEST(RotorVerdictRules, ModesAboveTheSpeedsAreSaidButForOneThatWasGiven) {
  Judged j;
  for (const double hertz : {20.0, 40.0, 50.0}) {
    ForcedMode mode;
    mode.omega = kTwoPi * hertz;
    j.result.model.rotor->modes.push_back(mode);
  }
  std::string said = j.run();
  EXPECT_THAT(said, Not(HasSubstr("the mode at 20 Hz")));
  EXPECT_THAT(said, HasSubstr("the mode at 40 Hz lies above the highest speed 30.0 Hz"));
  EXPECT_THAT(said, HasSubstr("the mode at 50 Hz"));
  j.result.active.modes.given = 1;
  said = j.run();
  EXPECT_THAT(said, Not(HasSubstr("the mode at 40 Hz")));
  EXPECT_THAT(said, HasSubstr("the mode at 50 Hz"));
}

TEST(RotorVerdictRules, ADelayIsSaidAndWhereItIsNoSensors) {
  Judged j;
  j.result.fit.delay = 4e-3;
  EXPECT_EQ(j.run(), "") << "not estimated";
  j.result.active.clock.delay = true;
  EXPECT_THAT(j.run(), HasSubstr("lags the angle by 4 ms; the phase of e rests on this: give"));
  j.result.fit.delay = 0;
  EXPECT_THAT(j.run(), HasSubstr("lags the angle by 0 ms; the phase of e rests on this: give"));
  for (const double delay : {5.1e-3, -1e-4}) {
    j.result.fit.delay = delay;
    EXPECT_THAT(j.run(), HasSubstr("(implausible for a sensor: rather an error of the angle)"));
  }
}

TEST(RotorVerdictRules, AProfileIsDoubtedWhereSomethingIsMissing) {
  Judged j;
  j.result.active.clock.profile_degree = 2;
  EXPECT_EQ(j.run(), "");
  j.summary.chi_square = 1.5;
  EXPECT_THAT(j.run(), HasSubstr("not the assumed profile corrected by a polynomial of degree 2"));
  EXPECT_THAT(j.run(), HasSubstr("widened by 1.2\n")) << "sqrt(1.5)";
  j.result.fit.summary.chi_square = 4;
  EXPECT_THAT(j.run(), HasSubstr("widened by 2\n"));
  j.result.active.clock.profile_degree = 0;
  EXPECT_THAT(j.run(), Not(HasSubstr("profile")));
}

TEST(RotorVerdictRules, AMachineThatChangedBetweenTheRecordsIsSaid) {
  Judged j;
  const double k1 = j.parameter("k1").value;
  j.parameter("k1_change_2") = estimate(0.02 * k1, 0.001 * k1);
  j.parameter("c_change_2") = estimate(0.1, 0.2);
  const std::string said = j.run();
  EXPECT_THAT(said, HasSubstr("k1 of run 2 is +2 +- 0.1 % beyond that of run 1"));
  EXPECT_THAT(said, Not(HasSubstr("c of run 2")));
  j.parameter("c_change_2") = estimate(-0.3, 0.03);
  EXPECT_THAT(j.run(), HasSubstr("c of run 2 is -10 +- 1 % beyond that of run 1"));
}

TEST(RotorVerdictRules, AWhirlByItselfIsSaidFromItsSpeedOn) {
  Judged j;
  RotorTerm term;
  term.entry = &terms::cross_coupled();
  term.value = 0.5 * j.result.fit.model.c * kTwoPi * 12;
  j.result.fit.terms = {term};
  EXPECT_THAT(j.run(), Not(HasSubstr("whirls by itself")));
  EXPECT_THAT(j.judged.trust, HasSubstr("c is without the cross-coupled stiffness"));
  j.result.fit.terms[0].value *= 4;
  EXPECT_THAT(j.run(), HasSubstr("the rotor whirls by itself"));
  EXPECT_THAT(j.run(), HasSubstr("near 12 Hz"));
}

TEST(RotorVerdictRules, WarningsOfTheFitAreHandedOn) {
  Judged j;
  j.result.fit.summary.warn("it says this");
  EXPECT_THAT(j.run(), HasSubstr("it says this"));
}

}  // namespace
}  // namespace whirl::identification
