// The judge of a run at its limits and beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

JudgedRun sound() {
  JudgedRun run;
  run.open.segment = {1e-3, 2e-3, 6e-3, 2e-3};
  run.closed.segment = {0.1e-3, 0.1e-3, 0.1e-3, 0.1e-3};
  return run;
}

std::string judged(const std::function<void(JudgedRun&)>& change, const VerdictLimits& limits = {}) {
  JudgedRun run = sound();
  change(run);
  const Verdict v = judge(run, limits);
  EXPECT_EQ(v.passed(), v.reasons.empty());
  return v.text();
}

TEST(JudgeRules, AtItsLimitARunPasses) {
  const VerdictLimits limits;
  EXPECT_EQ(judged([](JudgedRun&) {}), "");
  EXPECT_EQ(judged([&](JudgedRun& r) { r.saturated_turning = limits.saturated; }), "");
  EXPECT_THAT(judged([&](JudgedRun& r) { r.saturated_turning = 1.01 * limits.saturated; }),
              HasSubstr("at its limit 1.0 %"));
  EXPECT_EQ(judged([&](JudgedRun& r) { r.standstill_rms = limits.standing_rms; }), "");
  EXPECT_THAT(judged([&](JudgedRun& r) { r.standstill_rms = 1.1 * limits.standing_rms; }),
              HasSubstr("at standstill: 0.033 mm"));
  EXPECT_THAT(judged([](JudgedRun& r) { r.standstill_rms = std::nan(""); }), HasSubstr("at standstill"));
  EXPECT_EQ(judged([](JudgedRun& r) { r.survived = 1; }), "");
  EXPECT_THAT(judged([](JudgedRun& r) { r.survived = 0.999; }), HasSubstr("diverged after 100 %"));
  EXPECT_THAT(judged([](JudgedRun& r) { r.survived = 0.4, r.trip = Fault::displacement_limit; }),
              HasSubstr("tripped after 40 %"));
  EXPECT_THAT(judged([](JudgedRun& r) { r.standing_rms = 40e-6, r.standing_time = 2.5; }),
              HasSubstr("0.040 mm rms that does not turn with the rotor, 2.5 s into the run"));
}

// A segment is worse where it is so by the ratio and by the floor.
TEST(JudgeRules, ASegmentIsWorseByRatioAndFloor) {
  VerdictLimits limits;
  limits.segment_ratio = 1.1;
  const auto segment = [&](double open, double closed) {
    return judged([&](JudgedRun& r) { r.open.segment[1] = open, r.closed.segment[1] = closed; }, limits);
  };
  EXPECT_EQ(segment(1e-3, 1.099e-3), "");
  EXPECT_THAT(segment(1e-3, 1.101e-3), HasSubstr("segment 2 is worse than without control: 1.101 mm against 1.000 mm"));
  EXPECT_EQ(segment(10e-6, 14.9e-6), "") << "5 um beyond is where sensors end";
  EXPECT_THAT(segment(10e-6, 15.1e-6), HasSubstr("segment 2"));
  EXPECT_EQ(segment(0, 1e-3), "") << "nothing to compare with";
}

TEST(JudgeRules, TheForceIsComparedWithThatOfTheDesignsOwnRun) {
  const auto varied = [](double total, std::optional<double> excess) {
    return judged(
        [&](JudgedRun& r) { r.smooth_variation = 100, r.total_variation = total, r.nominal_excess = excess; });
  };
  EXPECT_EQ(varied(1e9, {}), "");
  EXPECT_EQ(varied(180, 20.0), "") << "1.5 times the nominal";
  EXPECT_THAT(varied(181, 20.0), HasSubstr("total variation 181 N/s, 1.5 times the nominal 120 N/s"));
  EXPECT_EQ(varied(150, -20.0), "") << "less than smooth is smooth";
  EXPECT_THAT(varied(151, -20.0), HasSubstr("the nominal 100 N/s"));
}

TEST(JudgeRules, MarginsComeFirstAndAreNoLossOfTheLoop) {
  JudgedRun run = sound();
  run.margins = "gain margin";
  run.saturated_turning = 0.5;
  const Verdict v = judge(run);
  EXPECT_TRUE(v.stable);
  ASSERT_EQ(v.reasons.size(), 2u);
  EXPECT_EQ(v.reasons.front(), "the margins of the design: gain margin");
  EXPECT_THAT(v.text(), HasSubstr("gain margin; the force is at its limit"));
  run.survived = 0.5;
  EXPECT_FALSE(judge(run).stable);
}

TEST(JudgeRules, MarginsThatADesignStatesAreHeldAgainstTheLimits) {
  const auto missed = [](const std::map<std::string, double>& margins) {
    ControllerDesign d;
    d.sample_time = 1e-3;
    d.margins = margins;
    return margin_shortfall(d);
  };
  EXPECT_EQ(missed({}), "");
  EXPECT_EQ(missed({{"delay_margin_s", 0.51e-3}}), "");
  EXPECT_THAT(missed({{"delay_margin_s", 0.49e-3}}), HasSubstr("delay margin"));
  EXPECT_THAT(missed({{"delay_margin_s", 0.0}}), HasSubstr("not stable"));
  EXPECT_EQ(missed({{"gain_margin", 1.34}, {"gain_margin_down", 0.79}, {"phase_margin_deg", 14.5}}), "");
  EXPECT_THAT(missed({{"gain_margin", 1.32}}), HasSubstr("gain margin 1.32"));
  EXPECT_THAT(missed({{"gain_margin_down", 0.81}}), HasSubstr("gain margin downwards"));
  EXPECT_THAT(missed({{"phase_margin_deg", 14.2}}), HasSubstr("phase margin 14.2 deg"));
  EXPECT_THAT(missed({{"peak_sensitivity", 4.1}}), HasSubstr("peak sensitivity 4.1"));
}

}  // namespace
}  // namespace whirl::tuning
