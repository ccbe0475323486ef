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
  bool lost = false;                      ///< at any time
};

Errors follow(MarkedShaft& s, double seconds) {
  TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.omega(), 0);
  Errors out;
  double sum = 0, squares = 0;
  const long n = std::lround(seconds * s.rate);
  for (long k = 0; k < n; ++k) {
    tracker.update(s.tick(), 1);
    out.lost = out.lost || tracker.lost();
    if (k < n / 5) continue;
    const double off = tracker.beta() - kRound * s.turn;
    out.most = std::max(out.most, std::abs(off));
    squares += off * off / (0.8 * static_cast<double>(n));
    const double e = tracker.omega() / (kRound * s.omega()) - 1;
    sum += e * e / (0.8 * static_cast<double>(n));
  }
  out.speed = std::sqrt(sum);
  out.angle = std::sqrt(squares);
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

// A busy machine: every other cycle comes a tick too late.
TEST(TachoTracker, ManyShortGapsDoNotLoseTheMarks) {
  for (const std::vector<double>& marks : {std::vector<double>{0}, std::vector<double>{0, 0.23, 0.5, 0.81}}) {
    MarkedShaft s;
    s.marks = marks;
    s.speed = 8;
    TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
    for (int k = 0; k < 4000; ++k) {
      double volts = s.tick();
      if (k % 2 == 0) volts = s.tick();
      tracker.update(volts, k % 2 == 0 ? 2 : 1);
      ASSERT_FALSE(tracker.lost()) << marks.size() << " marks, " << k;
      EXPECT_NEAR(tracker.beta(), kRound * s.turn, 0.3);
    }
  }
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

std::vector<double> even(int places, int present) {
  std::vector<double> marks;
  for (int k = 0; k < present; ++k) marks.push_back(static_cast<double>(k) / places);
  return marks;
}

/// What a tracker makes of a shaft: it is right, lost, or neither.
struct Verdict {
  explicit Verdict(const MarkedShaft& s, const TachoTracker& t) {
    const double error = std::abs(std::remainder(t.beta() - kRound * s.turn, kRound));
    lost = t.lost();
    right = !lost && error < std::max(0.3 * kRound / static_cast<double>(s.marks.size()), kRound * s.omega() * 2e-3) &&
            std::abs(t.omega() - kRound * s.omega()) < 0.3 * kRound * s.omega() + 2;
  }
  bool lost, right;
};

// Which of several even marks comes first after a standstill nobody can know; with one, or a gap between them, one can.
TEST(TachoTracker, AfterAStandstillTheShaftIsFoundAgainOrLost) {
  for (const std::vector<double>& marks : {even(1, 1), even(4, 4), even(8, 6), even(60, 60)}) {
    const bool findable = marks.size() == 1 || marks.size() == 6;
    for (unsigned seed = 1; seed <= 24; ++seed) {
      MarkedShaft s;
      s.random.seed(7000 + seed);
      s.marks = marks;
      s.width = marks.size() == 60 ? 0.4 / 60 : 0.06;
      const double fastest = marks.size() == 60 ? 4 : 16, start = fastest * (0.4 + 0.6 * s.draw());
      const double slowing = 0.5 + 4 * s.draw(), rest = 3 * s.draw(), speeding = 0.3 + 3 * s.draw();
      const double end = fastest * (0.3 + 0.7 * s.draw());
      s.turn = s.draw();
      s.speed = start;
      TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
      const auto go_on = [&] { tracker.update(s.tick(), 1); };
      for (int k = 0; k < 2000; ++k) go_on();
      ASSERT_TRUE(Verdict(s, tracker).right);
      while (s.speed > 0) {
        const double slower = seed % 2 == 0 ? slowing * 1e-3 : s.speed > 0.02 ? 0.1 * slowing * s.speed * 1e-3 : 1;
        s.speed = std::max(0.0, s.speed - slower), go_on();
      }
      for (int k = 0; k < 1000 * rest; ++k) go_on();
      double wrong = 0;  // turns at a wrong angle that is said to be known
      for (int k = 0; k < 1000 * (end / speeding + 4); ++k) {
        const double before = s.turn;
        s.speed = std::min(end, s.speed + speeding * 1e-3), go_on();
        const Verdict v(s, tracker);
        if (!v.lost && !v.right) wrong += s.turn - before;
      }
      const Verdict v(s, tracker);
      EXPECT_TRUE(v.right || (v.lost && !findable)) << marks.size() << " marks, seed " << seed << ", lost " << v.lost;
      EXPECT_LT(wrong, 4) << marks.size() << " marks, seed " << seed;
    }
  }
}

// The ramps are those of any rotor, 20 rad/s^2.
TEST(TachoTracker, AfterAGapItIsRightOrLostAndNeverAtAnotherMark) {
  for (const std::vector<double>& marks :
       {even(1, 1), even(4, 4), even(8, 6), std::vector<double>{0, 0.2, 0.55}, even(30, 30)}) {
    int briefly_lost = 0;
    for (unsigned seed = 1; seed <= 120; ++seed) {
      MarkedShaft s;
      s.random.seed(9000 + seed);
      s.marks = marks;
      s.width = marks.size() == 30 ? 0.4 / 30 : 0.06;
      const bool brief = seed <= 60;
      const long gap = brief ? 2 + std::lround(53 * s.draw()) : std::lround(std::pow(10, 1.5 + 2.5 * s.draw()));
      s.turn = s.draw();
      s.speed = marks.size() == 30 ? 6 : 9 + 3 * s.draw();
      const double ramp = seed % 3 == 0 ? 0.0 : 3.2 * (2 * s.draw() - 1);
      TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
      for (int k = 0; k < 2000; ++k) tracker.update(s.tick(), 1);
      const double most = marks.size() == 30 ? 7 : 16;
      double volts = 0;
      for (long k = 0; k < gap; ++k) s.speed = std::clamp(s.speed + ramp * 1e-3, 2.0, most), volts = s.tick();
      tracker.update(volts, gap);
      for (int k = 0; k < 3000; ++k) {
        tracker.update(s.tick(), 1);
        const Verdict v(s, tracker);
        briefly_lost += brief && v.lost && k == 0;
      }
      const Verdict v(s, tracker);
      const bool findable = marks.size() != 4 && marks.size() != 30;
      EXPECT_TRUE(v.right || (v.lost && !findable))
          << marks.size() << " marks, seed " << seed << ", gap of " << gap << " ticks, lost " << v.lost;
    }
    if (marks.size() == 30) continue;
    EXPECT_LE(briefly_lost, 2) << marks.size() << " marks: up to 55 ms the way is known";
  }
}

// A gap that nobody told of, such as that of a board that starts anew.
TEST(TachoTracker, AWheelThatShowsWhereItIsIsNotFollowedAtAnotherMark) {
  for (const std::vector<double>& marks : {even(1, 1), even(8, 6), std::vector<double>{0, 0.2, 0.55}, even(36, 35)}) {
    for (int gap = 3; gap < 1060; gap += 13) {
      MarkedShaft s;
      s.marks = marks;
      s.width = marks.size() == 35 ? 0.4 / 36 : 0.06;
      s.speed = marks.size() == 35 ? 5 : 9;
      TachoTracker tracker(tacho_of(s), kRound * s.turn, kRound * s.speed, 0);
      for (int k = 0; k < 2000; ++k) tracker.update(s.tick(), 1);
      for (int k = 0; k < gap; ++k) s.tick();
      for (int k = 0; k < 3000; ++k) tracker.update(s.tick(), 1);
      EXPECT_TRUE(Verdict(s, tracker).right) << marks.size() << " marks, gap of " << gap << ", " << tracker.lost();
    }
  }
}

}  // namespace
}  // namespace whirl::rt
