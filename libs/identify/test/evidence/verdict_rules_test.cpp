#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "evidence/verdict.hpp"
#include "rules/rules.hpp"

// The rules themselves, at their limits and beside them.
namespace whirl::identification {
namespace {

using detail::judge_held_out;
using ::testing::HasSubstr;

TEST(VerdictRules, FromFifteenPercentUnexplainedOnAModelIsUnusable) {
  for (const double share : {0.0, 0.1499}) {
    Summary s;
    EXPECT_TRUE(detail::judge_unexplained(share, "it leaves", "a cause", s));
    EXPECT_EQ(s.status, Status::ok);
    EXPECT_TRUE(s.findings.empty());
  }
  for (const double share : {0.15, 0.2, std::numeric_limits<double>::infinity(), std::nan("")}) {
    Summary s;
    EXPECT_FALSE(detail::judge_unexplained(share, "it leaves", "a cause", s));
    EXPECT_EQ(s.status, Status::unusable);
    ASSERT_NE(s.find(FindingCode::motion_unexplained), nullptr);
    EXPECT_THAT(s.warnings.front(), HasSubstr(": a cause"));
  }
}

TEST(VerdictRules, AChiSquareAboveItsLimitsWarnsAndAboveTheNextTakesTheTrust) {
  const auto judged = [](double chi_square) {
    Summary s;
    s.trust = "Trust it.";
    s.chi_square = chi_square;
    const bool warned = detail::judge_chi_square(chi_square, "; so", s);
    EXPECT_EQ(warned, s.status == Status::warning);
    detail::judge_remaining(s);
    return s;
  };
  for (const double fits : {0.5, 1.0, rules::kModelError.limit, std::nan("")}) {
    EXPECT_EQ(judged(fits).status, Status::ok);
    EXPECT_EQ(judged(fits).trust, "Trust it.");
  }
  for (const double off : {1.31, rules::kNoTrust.limit}) {
    const Summary s = judged(off);
    EXPECT_EQ(s.status, Status::warning);
    EXPECT_EQ(s.distrust(), nullptr);
    EXPECT_EQ(s.trust, "Trust it.");
  }
  const Summary far = judged(2.01);
  ASSERT_NE(far.distrust(), nullptr);
  EXPECT_EQ(far.warnings.size(), 1U) << "said once";
  EXPECT_EQ(far.findings.size(), 2U);
  EXPECT_THAT(far.trust, HasSubstr("Do not trust"));
}

// A probe that resolves a ten thousandth of the motion sees what no user of the model would.
TEST(VerdictRules, LessThanAThousandthOfTheMotionWarnsAndTakesNoTrustUpToTwiceTheLimit) {
  const auto judged = [](double chi_square, double share) {
    Summary s;
    s.trust = "Trust it.";
    s.chi_square = chi_square;
    detail::judge_chi_square(chi_square, "; so", s, share);
    detail::judge_remaining(s);
    return s;
  };
  for (const double chi_square : {2.01, 3.99}) {
    const Summary slight = judged(chi_square, 0.99e-3);
    EXPECT_EQ(slight.status, Status::warning);
    EXPECT_EQ(slight.distrust(), nullptr);
    EXPECT_EQ(slight.trust, "Trust it.");
    EXPECT_DOUBLE_EQ(slight.find(FindingCode::model_error)->amount("share"), 0.99e-3);
    EXPECT_THAT(slight.warnings.front(), HasSubstr("% of the motion unexplained"));
    for (const double share : {1e-3, 0.01, std::nan(""), std::numeric_limits<double>::infinity()})
      EXPECT_NE(judged(chi_square, share).distrust(), nullptr) << share;
  }
  EXPECT_NE(judged(4.01, 1e-4).distrust(), nullptr) << "every absent term shows a sign of it";
  EXPECT_EQ(judged(1.0, 1e-4).status, Status::ok);
}

TEST(VerdictRules, AChiSquareThatNobodyWarnedOfTakesTheTrustWithAWarning) {
  Summary s;
  s.chi_square = 2.01;
  detail::judge_remaining(s);
  EXPECT_EQ(s.status, Status::warning);
  EXPECT_NE(s.distrust(), nullptr);
  EXPECT_EQ(s.warnings.size(), 1U);
  Summary unusable;
  unusable.chi_square = 9;
  unusable.fail("no");
  detail::judge_remaining(unusable);
  EXPECT_TRUE(unusable.findings.empty());
}

TEST(VerdictRules, NothingIsTrustedOfAnUnusableModel) {
  Summary s;
  detail::set_trust("Trust it.", s);
  EXPECT_EQ(s.trust, "Trust it.");
  s.fail("no");
  detail::set_trust("Trust it.", s);
  EXPECT_EQ(s.trust, "Do not use this model.");
}

/// Judged part whose state moves by `motion` rms, read with `noise` and missed by `error` beyond it.
Summary judged(double motion, double noise, double error, int states = 1) {
  HeldOut held;
  held.what = "the last third";
  for (int i = 0; i < states; ++i) {
    const bool worst = i == states - 1;
    StateScore s;
    s.state = worst ? "x" : "good";
    s.noise = noise;
    s.rmse = worst ? std::hypot(error, noise) : noise;
    s.nrmse = s.rmse / std::hypot(motion, noise);
    held.scores.push_back(s);
  }
  Summary summary;
  summary.trust = "Trust it.";
  judge_held_out(held, summary);
  return summary;
}

TEST(VerdictRules, HalfTheMotionMissedIsUnusableWhateverStateMissesIt) {
  for (const int states : {1, 3}) {
    EXPECT_EQ(judged(1, 0.1, 0.51, states).status, Status::unusable);
    EXPECT_NE(judged(1, 0.1, 0.51, states).find(FindingCode::held_out_not_predicted), nullptr);
    EXPECT_NE(judged(1, 0.1, 0.49, states).status, Status::unusable);
    EXPECT_EQ(judged(1, 0.9, 1.01, states).status, Status::unusable) << "the noise is no part of the motion";
  }
  for (const double unit : {1e-6, 1e6}) {
    EXPECT_EQ(judged(unit, 0.1 * unit, 0.51 * unit).status, Status::unusable);
    EXPECT_NE(judged(unit, 0.1 * unit, 0.49 * unit).status, Status::unusable);
    EXPECT_NE(judged(0.05 * unit, unit, 2 * unit).find(FindingCode::held_out_not_predicted), nullptr) << "near rest";
  }
  EXPECT_EQ(judged(1, 0, 0.51).status, Status::unusable) << "a record without noise";
  EXPECT_NE(judged(1, 0, 0.49).status, Status::unusable);
}

// The limits belong to the models that may be used.
TEST(VerdictRules, AtTheLimitItselfNothingIsMissed) {
  for (const StateScore& at : {StateScore{"x", 0.5, 0.5, 0}, StateScore{"x", 1.3, 1, 1}}) {
    HeldOut held;
    held.scores = {at};
    Summary s;
    judge_held_out(held, s);
    EXPECT_EQ(s.status, Status::ok);
  }
}

TEST(VerdictRules, TwiceTheNoiseAndTwoPercentOfTheMotionTakeTheTrust) {
  const auto missed = [](double motion, double noise, double rmse) {
    return judged(motion, noise, std::sqrt(rmse * rmse - noise * noise)).find(FindingCode::held_out_missed) != nullptr;
  };
  EXPECT_TRUE(missed(10, 0.15, 0.31));
  EXPECT_FALSE(missed(10, 0.15, 0.29)) << "within twice the noise";
  EXPECT_FALSE(missed(100, 0.15, 0.31)) << "less than two percent of the motion";
  EXPECT_TRUE(missed(100, 0.1, 2.1));
  EXPECT_FALSE(missed(100, 0.1, 1.9));
  EXPECT_FALSE(missed(1, 0, 0.1)) << "no noise, no measure";
  const Summary s = judged(10, 0.15, 0.4, 3);
  ASSERT_NE(s.find(FindingCode::held_out_missed), nullptr);
  EXPECT_EQ(s.find(FindingCode::held_out_missed)->where, "x of the last third");
  EXPECT_EQ(s.status, Status::warning);
  EXPECT_NE(s.distrust(), nullptr);
}

TEST(VerdictRules, APartThatHoldsNoiseAloneTestsNothingAndRefusesNothing) {
  const Summary still = judged(0.5, 1, 0.5);  // 1.12 times the noise
  EXPECT_EQ(still.status, Status::ok);
  EXPECT_THAT(still.trust, HasSubstr("holds hardly more than noise"));
  EXPECT_EQ(judged(2, 1, 0.2).trust, "Trust it.");
  // Two states are little more than noise, and the third one moves.
  HeldOut held;
  held.what = "the rest";
  held.scores = {{"a", 1, 1, 1}, {"b", 1, 0.1, 1}};
  Summary moves;
  moves.trust = "Trust it.";
  judge_held_out(held, moves);
  EXPECT_EQ(moves.trust, "Trust it.");
}

/// Judged part that moves by 1 rms, read with noise 0.01 and missed by `error`; the rest leaves `band` open.
Summary judged_within(double band, double error) {
  HeldOut held;
  held.what = "the last third";
  held.scores = {{"x", error, error / std::hypot(1, 0.01), 0.01, band}};
  Summary summary;
  summary.trust = "Trust it.";
  judge_held_out(held, summary);
  return summary;
}

TEST(VerdictRules, WhatTheIntervalsOfTheRestAccountForContradictsNothing) {
  for (const double band : {0.0, std::nan(""), 0.02, 0.0999})
    EXPECT_NE(judged_within(band, 0.1).find(FindingCode::held_out_missed), nullptr) << band;
  const Summary within = judged_within(0.1, 0.1);
  EXPECT_EQ(within.find(FindingCode::held_out_missed), nullptr);
  EXPECT_EQ(within.trust, "Trust it.");
  EXPECT_EQ(judged_within(0.509, 0.51).status, Status::unusable);
  EXPECT_EQ(judged_within(0.511, 0.51).status, Status::ok);
}

TEST(VerdictRules, ARestThatLeavesTheMotionOpenTestsNothingAndSaysSo) {
  EXPECT_EQ(judged_within(0.249, 0.1).trust, "Trust it.");
  const Summary open = judged_within(0.251, 0.1);
  EXPECT_EQ(open.status, Status::ok);
  EXPECT_THAT(open.trust, HasSubstr("Nothing tests it: the rest leaves open how the last third moves."));
  // Beside a state that the rest does predict, something tests it.
  HeldOut held;
  held.scores = {{"x", 0.1, 0.1, 0.01, 0.5}, {"y", 0.1, 0.1, 0.01, 0.12}};
  Summary half;
  half.trust = "Trust it.";
  judge_held_out(held, half);
  EXPECT_EQ(half.trust, "Trust it.");
}

TEST(VerdictRules, DivergenceAndAPredictionThatWasNotMadeAreSaid) {
  HeldOut held;
  held.what = "the rest";
  held.scores = {{"a", 1, 0.1, 1}, {"b", std::numeric_limits<double>::infinity(), 1, 1}};
  Summary diverged;
  judge_held_out(held, diverged);
  EXPECT_EQ(diverged.status, Status::unusable);
  EXPECT_NE(diverged.find(FindingCode::held_out_diverges), nullptr);
  EXPECT_EQ(diverged.findings.size(), 1U);

  HeldOut none;
  none.what = "the rest";
  none.reason = "too short";
  Summary said;
  said.trust = "Trust it.";
  judge_held_out(none, said);
  EXPECT_EQ(said.status, Status::warning);
  EXPECT_NE(said.find(FindingCode::held_out_not_tried), nullptr);
  EXPECT_THAT(said.warnings.front(), HasSubstr("too short"));
  EXPECT_EQ(said.trust, "Trust it.");

  Summary unusable;
  unusable.fail("no");
  judge_held_out(held, unusable);
  EXPECT_TRUE(unusable.findings.empty());
}

// Where free runs part by chaos, the near ones judge.
TEST(VerdictRules, WithAHorizonTheNearRunsJudge) {
  HeldOut held;
  held.what = "the rest";
  held.horizon = 1;
  held.scores = {{"a", 1, 1, 0.01}};
  held.near = {{"a", 0.01, 0.01, 0.01}};
  Summary s;
  judge_held_out(held, s);
  EXPECT_EQ(s.status, Status::ok);
  held.horizon = 0;
  judge_held_out(held, s);
  EXPECT_EQ(s.status, Status::unusable);
}

}  // namespace
}  // namespace whirl::identification
