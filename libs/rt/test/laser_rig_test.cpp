// Lasers on serial lines beside a board: which frame belongs to which tick.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>

#include "hand_rig.hpp"

namespace whirl::rt {
namespace {

TEST_F(LaserRigRealtime, DistancesBecomeDisplacementsByTheCalibration) {
  const Measurement m = tick(32760 + 6424, 32760 + 6424);  // 1 mm of 10 mm further away
  EXPECT_TRUE(m.valid);
  EXPECT_NEAR(m.x, 1e-3, 2e-6);
  EXPECT_NEAR(m.y, -1e-3, 2e-6);
}

TEST_F(LaserRigRealtime, AnErrorCodeIsNoDisplacementAndEndsWithTheNextFrame) {
  EXPECT_TRUE(tick(40000, 40000).valid);
  const Measurement m = tick(40000, 262076);
  EXPECT_FALSE(m.valid);
  EXPECT_TRUE(std::isfinite(m.y));
  EXPECT_EQ(rig->state(0), InputState::good);
  EXPECT_EQ(rig->state(1), InputState::sensor_error);
  EXPECT_EQ(rig->sample(1).reading.error, optoncdt::SensorError::no_peak);
  EXPECT_TRUE(tick(40000, 40000).valid);
}

TEST_F(LaserRigRealtime, ASilentLaserIsBridgedForItsMaxAgeOnly) {
  EXPECT_TRUE(tick(40000, 40000).valid);
  int bridged = 0;
  while (bridged < 100 && tick(0, 40000).valid) ++bridged;
  EXPECT_EQ(bridged, 5);
  EXPECT_EQ(rig->state(0), InputState::too_old);
  EXPECT_EQ(rig->state(1), InputState::good);
  EXPECT_EQ(rig->late(0), 6);
}

// Laser and loop have clocks of their own: 0.9 per mille apart, they are a dozen ticks apart at the end.
TEST_F(LaserRigRealtime, ClocksThatRunApartAreFollowed) {
  long invalid = 0;
  for (int k = 1; k <= 12 * 1100; ++k) {
    const bool turn = k % 1100 == 0;
    if (turn) {
      for (int i = 0; i < 4; ++i) y.send(40000 + ++wiggle % 2);  // runs fast
      y.deliver(*rig->laser(1), 4);
    }
    invalid += !tick(turn ? 0 : 40000, 40000).valid;  // runs slowly
  }
  EXPECT_EQ(invalid, 0);
  // A laser that then falls silent is noticed as soon as any other.
  int bridged = 0;
  while (bridged < 100 && tick(40000, 0).valid) ++bridged;
  EXPECT_LE(bridged, 7);
}

TEST_F(LaserRigRealtime, AStuckLaserIsNotValid) {
  EXPECT_TRUE(tick(40000, 40000).valid);
  for (int k = 0; k < 40; ++k) {
    for (int i = 0; i < 4; ++i) x.send(41000);
    x.deliver(*rig->laser(0), 4);
    tick(0, 40000);
  }
  EXPECT_EQ(rig->state(0), InputState::stuck);
  EXPECT_EQ(rig->state(1), InputState::good);
}

// Which frames belong to a tick is learned while disarmed. A network or a busy machine holds readings back while frames
// still come, all at once or bit by bit; a board that starts anew counts from elsewhere.
struct LateReadingsRealtime : LaserRigRealtime {
  LateReadingsRealtime() : LaserRigRealtime(STDIN_FILENO) { rig->arm(false); }  // a clock that nobody waits for
  /// The board is at `ticks` further on; its readings did not come.
  void hold_back(int ticks) {
    board.answers = false;
    for (int k = 0; k < ticks; ++k) tick(40000, 40000);
    board.reading.tick += static_cast<std::uint32_t>(ticks);
    board.answers = true;
  }
  /// Ticks of the next hundred in which a frame was not new, or not valid.
  long misaligned() {
    const long before = rig->late(0) + rig->late(1);
    long invalid = 0;
    for (int k = 0; k < 100; ++k) invalid += !tick(40000, 40000).valid;
    return rig->late(0) + rig->late(1) - before + invalid;
  }
};

TEST_F(LateReadingsRealtime, ReadingsHeldBackOnceDoNotMakeEveryFrameSeemOld) {
  for (const int ticks : {1, 3, 36, 200}) {
    hold_back(ticks);
    tick(40000, 40000);
    EXPECT_EQ(misaligned(), 0) << ticks;
  }
}

TEST_F(LateReadingsRealtime, ReadingsThatCatchUpBitByBitDoNotEither) {
  for (int k = 0; k < 128; ++k) tick(40000, 40000);
  board.answers = false;
  for (int k = 0; k < 36; ++k) tick(40000, 40000);
  board.answers = true;
  for (int k = 0; k < 6; ++k) {
    board.reading.tick += 6;
    tick(40000, 40000);
  }
  EXPECT_EQ(misaligned(), 0);
}

TEST_F(LateReadingsRealtime, ABoardThatCountsFromElsewhereIsAlignedAnew) {
  for (const std::uint32_t by : {5000u, 0u - 7000u, 0u - 3u}) {
    board.reading.tick += by;
    ++board.reading.session;
    for (int k = 0; k < 128; ++k) tick(40000, 40000);
    rig->arm(true);
    EXPECT_EQ(misaligned(), 0) << by;
    rig->arm(false);
  }
}

// A converter between the lines and this machine hands over bunches: the newest frame of a bunch is of its tick.
TEST_F(LateReadingsRealtime, FramesInBunchesBelongToTheTickInWhichTheyCome) {
  constexpr int kBunch = 4;
  long late = 0;
  for (int k = 0; k < 50 * kBunch; ++k) {
    const bool come = k % kBunch == kBunch - 1;
    if (come) {
      for (int i = 0; i < 4 * (kBunch - 1); ++i) x.send(40000 + ++wiggle % 2);
    }
    const long before = rig->late(0);
    tick(come ? 40000 : 0, 40000);
    if (come && k > 25 * kBunch) late += rig->late(0) - before;
  }
  EXPECT_EQ(late, 0);
}

TEST_F(LaserRigRealtime, DisarmedASilentLaserIsNoSampleEither) {
  rig->arm(false);
  int bridged = 0;
  while (bridged < 100 && tick(0, 40000).valid) ++bridged;
  EXPECT_EQ(bridged, 5);
  EXPECT_EQ(rig->state(0), InputState::too_old);
  while (!tick(40000, 40000).valid && bridged < 300) ++bridged;
  bridged = 0;
  while (bridged < 100 && tick(40000, 0).valid) ++bridged;
  EXPECT_EQ(bridged, 5);
}

// The lasers go on while cycles are left out: what falls silent then is noticed as soon as ever.
TEST_F(LaserRigRealtime, TicksLeftOutMakeNoLaserYounger) {
  for (int gap = 0; gap < 5; ++gap) {
    for (int k = 0; k < 4 * 20; ++k) x.send(40000 + ++wiggle % 2), y.send(40000 + ++wiggle % 2);
    rig->left_out(20);
    EXPECT_TRUE(tick(40000, 40000).valid) << gap;
  }
  int bridged = 0;
  while (bridged < 200 && tick(0, 40000).valid) ++bridged;
  EXPECT_EQ(bridged, 5);
}

/// On the clock of the samples.
struct LaserSourceRealtime : LaserRigRealtime {
  explicit LaserSourceRealtime(int descriptor = -1) : LaserRigRealtime(descriptor) {
    rig->arm(false);
    board.once = true;
    for (int k = 0; k < 20; ++k) cycle(true, true);
  }
  /// Ticks that it advanced.
  long cycle(bool of_x, bool of_y) {
    for (int i = 0; i < 2; ++i) {
      HandLaser& laser = i == 0 ? x : y;
      if (!(i == 0 ? of_x : of_y)) continue;
      for (int k = 0; k < 4; ++k) laser.send(40000 + ++wiggle % 2);
      laser.deliver(*rig->laser(i), 4);
    }
    board.answers = true;
    const long advanced = rig->wait(1'000'000);
    last = rig->read();
    return advanced;
  }
  Measurement last;
};
struct ClockedBoardRealtime : LaserSourceRealtime {
  ClockedBoardRealtime() : LaserSourceRealtime(STDIN_FILENO) {}
};

TEST_F(LaserSourceRealtime, ABoardWithoutAClockIsReadOncePerCycle) {
  for (const bool armed : {false, true}) {
    rig->arm(armed);
    for (int k = 0; k < 20; ++k) {
      const long before = board.reads;
      EXPECT_EQ(cycle(true, true), 1);
      EXPECT_EQ(board.reads - before, 1);
      EXPECT_TRUE(last.valid);
    }
  }
}

TEST_F(LaserSourceRealtime, WhereNothingComesNothingStaysValid) {
  EXPECT_TRUE(last.valid);
  int bridged = 0;
  while (bridged < 100 && cycle(false, false) == 0 && last.valid) ++bridged;
  EXPECT_EQ(bridged, 5) << "waits of 1 ms";
  cycle(true, true);
  EXPECT_TRUE(last.valid);
}

// A laser that starts again counts from elsewhere. Armed, that is a gap; disarmed, the loop goes on at once.
TEST_F(ClockedBoardRealtime, AJumpOfALaserDoesNotLetTheLoopStand) {
  rig->arm(true);
  EXPECT_EQ(cycle(true, true), 1);
  y.jump(20000);
  EXPECT_GT(cycle(true, true), 1000);
  rig->arm(false);
  for (int k = 0; k < 128; ++k) EXPECT_EQ(cycle(true, true), 1) << k;
  EXPECT_TRUE(last.valid);
  rig->arm(true);
  for (int k = 0; k < 20; ++k) {
    EXPECT_EQ(cycle(true, true), 1) << k;
    EXPECT_TRUE(last.valid);
  }
}

}  // namespace
}  // namespace whirl::rt
