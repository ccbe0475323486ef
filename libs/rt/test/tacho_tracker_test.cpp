// Angle from a tacho on an analogue input, tick by tick, against a shaft that is computed apart.
#include "whirl/rt/drivers/tacho_tracker.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace whirl::rt {
namespace {

constexpr double kRound = 2 * std::numbers::pi;

/// A shaft with marks `width` turns wide; some pulses are lost, some are added by disturbances of one tick.
struct MarkedShaft {
  std::vector<double> marks{0};
  double width = 0.1, speed = 20, ramp = 0, wander = 0, lost = 0, added = 0, rate = 1000;
  std::mt19937_64 random{1};
  double turn = 0.3, time = 0;

  double draw() { return std::uniform_real_distribution<double>(0, 1)(random); }
  double omega() const { return std::max(0.0, speed + ramp * time + wander * std::sin(3 * time)); }
  /// Volts of the next tick.
  double tick() {
    const int parts = 20;
    for (int i = 0; i < parts; ++i) turn += omega() / (parts * rate), time += 1 / (parts * rate);
    const double at = turn - std::floor(turn);
    double volts = 0.05 * (draw() - 0.5);
    for (std::size_t k = 0; k < marks.size(); ++k) {
      if (at < marks[k] || at >= marks[k] + width) continue;
      const auto pulse = static_cast<std::uint64_t>(std::floor(turn)) * 64 + k;
      std::mt19937_64 own(pulse * 2654435761ull + 17);
      own.discard(3);
      if (std::uniform_real_distribution<double>(0, 1)(own) >= lost) volts += 5;
    }
    if (draw() < added) volts = 5;
    return volts;
  }
};

TachoMarks tacho_of(const MarkedShaft& s) {
  TachoMarks m;
  m.marks = s.marks;
  m.sample_time = 1 / s.rate;
  return m;
}

struct Errors {
  double angle = 0, most = 0, speed = 0;  ///< rms and largest, rad; rms share
  bool lost = false;
};

Errors follow(MarkedShaft& s, double seconds) {
  TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.omega(), 0);
  Errors out;
  double sum = 0, squares = 0;
  const long n = std::lround(seconds * s.rate);
  for (long k = 0; k < n; ++k) {
    tracker.update(s.tick(), 1);
    if (k < n / 5) continue;
    const double off = tracker.beta() - kRound * s.turn;
    out.most = std::max(out.most, std::abs(off));
    squares += off * off / (0.8 * static_cast<double>(n));
    const double e = tracker.omega() / (kRound * s.omega()) - 1;
    sum += e * e / (0.8 * static_cast<double>(n));
  }
  out.speed = std::sqrt(sum);
  out.angle = std::sqrt(squares);
  out.lost = tracker.lost();
  return out;
}

// An edge is known to a tick of the loop. A pulse shows three ticks at least, as the loop's learning asks for.
TEST(TachoTracker, PatternsWithLostAndAddedPulsesAreFollowed) {
  const std::vector<std::vector<double>> patterns{
      {0}, {0, 0.23, 0.5, 0.81}, {0, 0.4}, {0, 1.0 / 6, 2.0 / 6, 3.0 / 6, 4.0 / 6}};
  int shafts = 0, lost = 0, near = 0, fast = 0;
  for (std::size_t p = 0; p < patterns.size(); ++p) {
    for (unsigned seed = 1; seed <= 50; ++seed, ++shafts) {
      MarkedShaft s;
      s.random.seed(50'000 + 1000 * p + seed);
      s.marks = patterns[p];
      s.width = 0.4 / (2.0 * static_cast<double>(s.marks.size()));
      s.speed = std::min(6 + 20 * s.draw(), s.width * s.rate / 3);
      s.wander = 0.01 * s.speed;
      s.ramp = 0.05 * s.speed * (2 * s.draw() - 1);
      s.lost = 0.02;
      s.added = 0.002;
      const double tick = kRound * s.speed * 1.3 / s.rate;
      const Errors e = follow(s, 6);
      lost += e.lost;
      near += e.angle < tick && e.most < 0.4 * kRound / static_cast<double>(s.marks.size());
      fast += e.speed < 0.02;
    }
  }
  EXPECT_LE(lost, shafts / 100) << "3 to 30 % of the pulses are lost or added";
  EXPECT_GE(near, shafts * 95 / 100) << "rms of a tick, never to another mark";
  EXPECT_GE(fast, shafts * 95 / 100) << "2 % rms";
}

TEST(TachoTracker, ADeadTachoStandsAfterThreeMarks) {
  MarkedShaft s;
  TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
  for (int k = 0; k < 1000; ++k) tracker.update(s.tick(), 1);
  ASSERT_FALSE(tracker.lost());
  for (int k = 0; k < 300; ++k) tracker.update(0, 1);
  EXPECT_TRUE(tracker.lost());
  const double stands = tracker.beta();
  tracker.update(0, 1);
  EXPECT_EQ(tracker.beta(), stands);
  EXPECT_LE(tracker.beta() - kRound * s.turn, kRound * 5);
}

TEST(TachoTracker, TicksLeftOutMoveTheAngleOnAndCountAPulseAsLost) {
  MarkedShaft s;
  TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
  for (int k = 0; k < 2000; ++k) {
    double volts = s.tick();
    long ticks = 1;
    for (; k % 97 == 0 && ticks < 12; ++ticks) volts = s.tick();
    tracker.update(volts, ticks);
    EXPECT_NEAR(tracker.beta(), kRound * s.turn, 0.3);
  }
  EXPECT_FALSE(tracker.lost());
}

TEST(TachoTracker, ARotorThatComesToRestDoesNotTurnBack) {
  for (const double ramp : {-1.0, -4.0, -15.0}) {
    MarkedShaft s;
    s.ramp = ramp;
    TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, kRound * s.ramp);
    double before = tracker.beta();
    const long n = std::lround(1000 * (-20 / ramp + 2));
    for (long k = 0; k < n; ++k) {
      tracker.update(s.tick(), 1);
      EXPECT_GE(tracker.beta(), before - kRound * 0.15);
      EXPECT_GE(tracker.omega(), 0);
      before = tracker.beta();
    }
    EXPECT_NEAR(tracker.beta(), kRound * s.turn, kRound * 1.2) << ramp;
  }
}

}  // namespace
}  // namespace whirl::rt
