// The searches for findings by themselves: records over the angle are written down here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "findings/channel_study.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

/// A channel of `turns` turns from `from` to `to` Hz, evenly in time, with noise of `noise` rms.
struct Written {
  AngularChannel channel;
  VibrationOptions options{.mains = {50}};
  VibrationFindings result;
  ChannelStudy study;

  using Motion = std::function<double(double turn, double time)>;
  Written(Eigen::Index turns, double from, double to, double noise, const Motion& motion, unsigned seed = 1)
      : study{.channel = channel, .options = options, .result = result} {
    channel.name = "x";
    channel.per_turn = 16;
    const Eigen::Index n = turns * channel.per_turn;
    const double seconds = 2 * static_cast<double>(turns) / (from + to), rate = (to - from) / seconds;
    channel.rate = static_cast<double>(n) / seconds;
    channel.samples.resize(n);
    channel.time.resize(n);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, noise);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double turn = static_cast<double>(i) / channel.per_turn;
      const double time = 2 * turn / (from + std::sqrt(from * from + 2 * rate * turn));
      channel.time[i] = time;
      channel.samples[i] = motion(turn, time) + normal(random);
    }
    result.low_speed = kTwoPi * from, result.high_speed = kTwoPi * to;
  }
  const VibrationFinding* electric() {
    find_electric(study);
    return result.find(VibrationCode::line_frequency);
  }
  const VibrationFinding* subsynchronous() {
    find_subsynchronous(study);
    return result.find(VibrationCode::subsynchronous);
  }
};

double wave(double place) { return std::cos(kTwoPi * place); }

TEST(FindingRules, WithoutNoiseAnythingIsALineAndNothingIsNone) {
  EXPECT_LT(exceedance(1e-9, std::vector<double>(8)), 1e-200);
  EXPECT_EQ(exceedance(0, std::vector<double>(8)), 1);
}

// Between the places that are looked at, where the chance is less than at each of these.
TEST(FindingRules, ALineOfASupplyHasTheChanceOfItsTopTimesThePlacesLookedAt) {
  Written w(256, 17.3, 17.3, 1e-3, [](double, double t) { return wave(50.012 * t); });
  const VibrationFinding* const line = w.electric();
  ASSERT_NE(line, nullptr);
  EXPECT_NEAR(line->frequency, 50.012, 1e-3);
  const LineBlock block(w.channel, 0, 256, order_lines());
  const double step = 0.5 / block.duration(), top = block.added({0, line->frequency}).chance;
  for (int k = -5; k <= 5; ++k) EXPECT_LT(top, 0.9 * block.added({0, 50 + k * step}).chance) << k;
  EXPECT_NEAR(line->chance / (11 * top), 1, 1e-9);
}

// More power just beyond the range refuses a line near that end, as its skirt; it says nothing of one away from it.
TEST(FindingRules, ALargerLineBesideTheRangeForAWhileHidesNoLineOfTheSupply) {
  for (const double other : {49.77, 50.23}) {
    Written w(496, 17.3, 17.3, 0.02,
              [&](double turn, double t) { return 0.1 * wave(50 * t) + (turn < 256 ? 0.25 * wave(other * t) : 0); });
    const VibrationFinding* const line = w.electric();
    ASSERT_NE(line, nullptr) << other;
    EXPECT_NEAR(line->frequency, 50, 0.02) << other;
    EXPECT_FALSE(line->off_supply) << other;
  }
}

// 1X at 44 Hz, modulated by 6 Hz.
TEST(FindingRules, OneLineOfAPairAboutTheSpeedIsNoLineOfASupply) {
  for (const double mirror : {0.2, 0.02}) {
    Written w(256, 44, 44, 0.02,
              [&](double turn, double t) { return wave(turn) + 0.2 * wave(50 * t) + mirror * wave(38 * t + 0.1); });
    EXPECT_EQ(w.electric() == nullptr, mirror == 0.2);
  }
}

// 1.5X at 49.2 Hz, a line of its own skirts two lines of the spectrum above it.
TEST(FindingRules, WhatStandsBesideAnOrderIsNoLineOffTheSupply) {
  for (const double away : {2.0, 6.0}) {
    Written w(256, 32.8, 32.8, 0.02,
              [&](double turn, double t) { return wave(turn) + 0.2 * wave((49.2 + away * 32.8 / 256) * t); });
    EXPECT_EQ(w.electric() == nullptr, away == 2) << away;
  }
}

TEST(FindingRules, OfTwoLinesOffTheSupplyOnEitherSideOfAnOrderTheSurerOneIsNamed) {
  for (const double surer : {49.2, 50.9}) {
    Written w(256, 33.35, 33.35, 0.1, [&](double turn, double t) {
      return wave(turn) + 0.2 * wave(surer * t) + 0.03 * wave((100.1 - surer) * t);
    });
    const VibrationFinding* const line = w.electric();
    ASSERT_NE(line, nullptr) << surer;
    EXPECT_NEAR(line->frequency, surer, 0.02) << surer;
  }
}

TEST(FindingRules, OrdersBelowHalfAStepOfTheConverterDoNotCount) {
  Written w(256, 40, 40, 1e-3, [](double turn, double) { return wave(turn) + wave(3 * turn) + 0.1 * wave(4 * turn); });
  for (const auto& [step, orders] :
       {std::pair{0.19, std::vector<double>{3, 4}}, std::pair{0.21, std::vector<double>{3}}}) {
    w.channel.quantum = step;
    w.result.findings.clear();
    w.study.blocks = blocks_of(w.channel, order_lines(), kLongBlock, kSteadyBlock);
    find_orders(w.study);
    const VibrationFinding* const harmonics = w.result.find(VibrationCode::harmonics);
    ASSERT_NE(harmonics, nullptr);
    EXPECT_EQ(harmonics->orders, orders) << step;
  }
}

// The largest 1X at 100 Hz: below 45 Hz from 36 Hz on, or from 20 Hz on.
TEST(FindingRules, RunOutNeedsSlowTurnsOverHalfAsMuchSpeedAgain) {
  for (const double from : {36.0, 20.0}) {
    Written w(1600, from, 100, 1e-4, [](double turn, double t) { return (0.3 + 0.01 * t * t) * wave(turn); });
    w.study.blocks = blocks_of(w.channel, order_lines(), kLongBlock, kSteadyBlock);
    find_run_out(w.study);
    EXPECT_EQ(w.result.find(VibrationCode::run_out) == nullptr, from == 36) << from;
    ASSERT_EQ(w.result.unjudged.size(), from == 36 ? 1u : 0u);
    for (const Unjudged& u : w.result.unjudged) EXPECT_EQ(u.reason, UnjudgedReason::no_slow_turns);
  }
}

// The lowest order that is looked for; a line at 21/64 raises the noise beside it more than that half a line above it.
TEST(FindingRules, AWhirlAtTheLowestOrderIsReadThere) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    Written w(
        256, 50, 50, 0.05,
        [](double turn, double) { return wave(turn) + 0.3 * wave(0.38 * turn) + 0.06 * wave(21.0 / 64 * turn); }, seed);
    const VibrationFinding* const whirl = w.subsynchronous();
    ASSERT_NE(whirl, nullptr) << seed;
    EXPECT_NEAR(whirl->order, 0.38, 2e-4) << seed;
  }
}

// 48 Hz, up to 145 Hz from 105 Hz on or from the begin: where it is no subharmonic it is another machine.
TEST(FindingRules, AWhipIsALineOfFixedFrequencyThatOnlyHighSpeedsHave) {
  for (const double begin : {105.0, 0.0}) {
    Written w(1024, 40, 145, 0.05, [&](double turn, double t) {
      const double speed = 40 + 105 * t / (2 * 1024 / 185.0);
      return wave(turn) + (speed > begin ? 0.3 * wave(48 * t) : 0);
    });
    const VibrationFinding* const whip = w.subsynchronous();
    if (begin == 0) {
      EXPECT_TRUE(whip == nullptr || whip->causes.front() != Cause::oil_whip);
      continue;
    }
    ASSERT_NE(whip, nullptr);
    EXPECT_EQ(whip->causes.front(), Cause::oil_whip);
    EXPECT_NEAR(whip->frequency, 48, 0.1);
  }
}

// Two lines that blocks of 64 turns do not tell apart: a flat top with 1.4 % less at half the speed, or a third.
TEST(FindingRules, AFlatTopThatReachesHalfTheSpeedIsNoWhirl) {
  constexpr double kApart = 1.25 / 64;
  for (const double middle : {0.4945, 0.488}) {
    Written w(256, 50, 50, 0.02, [&](double turn, double) {
      return wave(turn) + 0.3 * wave((middle - kApart / 2) * turn) + 0.3 * wave((middle + kApart / 2) * turn);
    });
    EXPECT_EQ(w.subsynchronous() == nullptr, middle == 0.4945) << middle;
  }
}

// Far above the noise a line at half the speed leaks beside it: two hundredths of the likelihood decide.
TEST(FindingRules, ALineAtHalfTheSpeedIsNoWhirlHoweverLargeItIs) {
  for (const double size : {0.1, 1.0, 10.0, 100.0}) {
    for (const double order : {0.5, 0.47}) {
      Written w(256, 50, 50, 0.05, [&](double turn, double) { return wave(turn) + size * wave(order * turn); });
      EXPECT_EQ(w.subsynchronous() == nullptr, order == 0.5) << size << " at " << order;
    }
  }
}

}  // namespace
}  // namespace whirl::diagnosis::detail
