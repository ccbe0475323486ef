#include "whirl/rt/drivers/hardware_rig.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "hand_rig.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rt/drivers/angle_tracker.hpp"
#include "whirl/rt/faults.hpp"

namespace whirl::rt {
namespace {

HardwareOptions analog() {
  HardwareOptions o;
  o.position[0].analog = 0;
  o.position[1].analog = 2;
  return o;
}

double volts(double milliampere, double shunt = 250) { return 1e-3 * milliampere * shunt; }

struct HardwareRigRealtime : ::testing::Test {
  HandBoard::State board;
  HardwareRig make(const HardwareOptions& o) { return HardwareRig(o, std::make_unique<HandBoard>(board)); }
  /// Inputs in mA; never twice the same, as real ones.
  Measurement tick(HardwareRig& rig, double x, double y, bool noise = true) {
    const double n = noise ? 1e-9 * static_cast<double>(++count) : 0;
    board.reading.analog = {volts(x) + n, 0, volts(y) + n, 0};
    return rig.read();
  }
  long count = 0;
};

TEST_F(HardwareRigRealtime, CurrentsBecomeDisplacementsByTheCalibration) {
  HardwareOptions o = analog();
  o.position[0].laser.range = 0.010;
  o.position[0].offset = 4e-3;
  o.position[0].gain = 1.02;
  o.position[0].direction = -1;
  o.position[1].laser.range = 0.025;
  HardwareRig rig = make(o);
  const Measurement m = tick(rig, 12, 6);
  EXPECT_TRUE(m.valid);
  EXPECT_NEAR(m.x, -1.02 * (5e-3 - 4e-3), 1e-9);
  EXPECT_NEAR(m.y, 0.125 * 0.025, 1e-9);
}

TEST_F(HardwareRigRealtime, ACurrentOutsideItsLoopIsNoDisplacement) {
  HardwareRig rig = make(analog());
  for (const double bad : {3.5, 0.0, -4.0, 20.5, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(tick(rig, 12, 12).valid);
    EXPECT_FALSE(tick(rig, 12, bad).valid);
    EXPECT_EQ(rig.state(0), InputState::good);
    EXPECT_EQ(rig.state(1), InputState::current);
  }
  EXPECT_TRUE(tick(rig, 3.7, 20.3).valid);
}

TEST_F(HardwareRigRealtime, ASignalThatRepeatsItselfIsStuckUntilItMoves) {
  HardwareOptions o = analog();
  o.stuck = 25e-3;
  HardwareRig rig = make(o);
  tick(rig, 12, 12);
  int good = 0;
  while (good < 100 && tick(rig, 12, 12, false).valid) ++good;
  EXPECT_EQ(good, 26) << "the first of the run, and 25 ticks of it";
  EXPECT_EQ(rig.state(0), InputState::stuck);
  EXPECT_TRUE(tick(rig, 12, 12).valid);
  o.stuck = 0;
  HardwareRig blind = make(o);
  for (int k = 0; k < 200; ++k) EXPECT_TRUE(tick(blind, 12, 12, false).valid);
}

TEST_F(HardwareRigRealtime, ASilentOrLostBoardDemandsATrip) {
  HardwareRig rig = make(analog());
  board.answers = false;
  EXPECT_FALSE(rig.read().valid);
  EXPECT_EQ(rig.state(0), InputState::no_sample);
  board.answers = true;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none);
  board.answers = false;
  int ticks = 0;
  for (; ticks < 1000 && rig.fault() == Fault::none; ++ticks) rig.read();
  EXPECT_EQ(ticks, 51) << "50 ms and one tick";
  EXPECT_EQ(rig.fault(), Fault::watchdog);
  board.answers = true;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none);
  board.online = false;
  EXPECT_EQ(rig.fault(), Fault::watchdog);
  board.reading.done = true;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none) << "after the end nothing is missing";
}

// The rotor brakes to rest at several rates; the speed is an encoder filter's, which overshoots there.
TEST_F(HardwareRigRealtime, AHundredQuickStopsAreNoDeadEncoderAndADeadEncoderIsFound) {
  constexpr int kStops = 100;
  for (int stop = 0; stop < kStops; ++stop) {
    const double rpm_per_s = 100 + 2900.0 * stop / (kStops - 1);
    const double start = 20 + std::fmod(37.0 * stop, 56.0);  // rad/s
    for (const bool dead : {false, true}) {
      if (dead && stop % 10 != 0) continue;
      board = {};
      HardwareRig rig = make(analog());
      AngleTracker tracker(4096, 5, 1e-3);
      const double a = rpm_per_s * 2 * std::numbers::pi / 60;
      double angle = 0.1 * stop, speed = start;
      Fault fault = Fault::none;
      int at = -1;
      std::int32_t count_now = 0;
      for (int k = 0; k < 3000; ++k) {
        if (k == 100) rig.arm(true);
        if (k > 500) speed = std::max(0.0, speed - a * 1e-3);
        angle += speed * 1e-3;
        if (!dead || k <= 450) count_now = static_cast<std::int32_t>(angle / (2 * std::numbers::pi) * 4096);
        tracker.update(count_now);
        board.reading.beta = tracker.beta();
        board.reading.omega = tracker.omega();
        board.reading.omega_dot = tracker.omega_dot();
        tick(rig, 12, 12);
        if (fault == Fault::none && rig.fault() != Fault::none) fault = rig.fault(), at = k;
      }
      EXPECT_EQ(fault, dead ? kEncoderStuck : Fault::none)
          << rpm_per_s << " rpm/s from " << start << " rad/s, at " << at << ": " << to_string(fault);
      if (dead) {
        EXPECT_LE(at, 450 + 45) << "within 45 ms";
      }
    }
  }
}

TEST_F(HardwareRigRealtime, WhatABoardCannotSaySaysSo) {
  const auto after = [&](auto&& change) {
    board = {};
    HardwareRig rig = make(analog());
    rig.arm(true);
    for (int k = 0; k < 50; ++k) {
      board.reading.beta += 0.06;
      board.reading.omega = 60;
      tick(rig, 12, 12);
    }
    EXPECT_EQ(rig.fault(), Fault::none);
    change(board.reading);
    tick(rig, 12, 12);
    const Fault fault = rig.fault();
    rig.arm(false);
    tick(rig, 12, 12);
    rig.arm(true);
    EXPECT_EQ(rig.fault(), Fault::none) << "a new start looks anew";
    return fault;
  };
  EXPECT_EQ(after([](BoardReading& r) { r.beta += 0.06; }), Fault::none);
  EXPECT_EQ(after([](BoardReading& r) { r.tick += 3, r.beta += 0.24; }), Fault::none) << "lost ticks";
  EXPECT_EQ(after([](BoardReading& r) { r.tick += 1u << 30; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.tick -= 20, r.beta += 0.06; }), kImplausible) << "the board started again";
  EXPECT_EQ(after([](BoardReading& r) { r.beta += 1e6; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.beta += 2; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.beta = 1e13; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.omega = 1e5; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.omega_dot = 1e7; }), kImplausible);
  EXPECT_EQ(after([](BoardReading& r) { r.session = 7, r.beta += 0.06; }), kBoardRestarted);
  EXPECT_EQ(after([](BoardReading& r) { r.session = 7, r.tick = 0, r.beta = 0; }), kBoardRestarted);
}

TEST_F(HardwareRigRealtime, AnExpiredBoardAndAStandingAngleTripTheArmedLoop) {
  HardwareRig rig = make(analog());
  tick(rig, 12, 12);
  rig.arm(true);
  board.reading.omega = 100;
  int ticks = 0;
  for (; ticks < 1000 && rig.fault() == Fault::none; ++ticks) tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), kEncoderStuck);
  EXPECT_NEAR(ticks, 26, 1);
  board.reading.beta += 0.1;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none);
  board.reading.omega = 0;
  for (int k = 0; k < 200; ++k) tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none) << "a shaft at rest may stand";
  board.reading.expired = true;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::watchdog);
  rig.arm(false);
  EXPECT_EQ(rig.fault(), Fault::none);
}

TEST_F(HardwareRigRealtime, ForcesBecomeVoltsAndZeroWhenDisarmed) {
  HardwareOptions o = analog();
  o.force[0] = {.force_per_volt = 4, .offset = 0.1, .limit = 2, .direction = -1};
  o.force[1] = {.force_per_volt = 2, .offset = 0, .limit = 10, .direction = 1};
  {
    HardwareRig rig = make(o);
    tick(rig, 12, 12);
    rig.write({4, 4});
    EXPECT_EQ(board.written.volts[0], 0) << "disarmed: not even the offset";
    EXPECT_FALSE(board.written.armed);
    EXPECT_FALSE(board.written.start);
    rig.arm(true);
    rig.write({4, 4});
    EXPECT_DOUBLE_EQ(board.written.volts[0], -0.9);
    EXPECT_DOUBLE_EQ(board.written.volts[1], 2);
    EXPECT_EQ(board.written.answers, board.reading.tick);
    EXPECT_TRUE(board.written.start);
    rig.write({-100, std::numeric_limits<double>::quiet_NaN()});
    EXPECT_EQ(board.written.volts[0], 2);
    EXPECT_EQ(board.written.volts[1], 0);
    rig.stay_at_rest();
    rig.write({4, 4});
    EXPECT_TRUE(board.written.armed);
    EXPECT_FALSE(board.written.start);
  }
  EXPECT_FALSE(board.written.armed) << "the end of the rig is the end of the force";
  EXPECT_EQ(board.written.volts[1], 0);
}

TEST_F(HardwareRigRealtime, OptionsOutOfRangeAreRefused) {
  const auto refused = [&](auto change) {
    HardwareOptions o = analog();
    change(o);
    EXPECT_THROW((void)make(o), Error);
  };
  refused([](HardwareOptions& o) { o.position[0].direction = 2; });
  refused([](HardwareOptions& o) { o.position[0].gain = 0; });
  refused([](HardwareOptions& o) { o.position[1].analog = 4; });
  refused([](HardwareOptions& o) { o.position[1].shunt = 1; });
  refused([](HardwareOptions& o) { o.force[0].force_per_volt = 0; });
  refused([](HardwareOptions& o) { o.force[1].direction = 0; });
  refused([](HardwareOptions& o) { o.sample_time = 0; });
  refused([](HardwareOptions& o) {
    o.position[0].laser.device = "/dev/null";
    o.position[0].laser.measuring_rate = 2500;
  });
}

TEST_F(HardwareRigRealtime, ABoardThatWasNeverHeardIsAReasonNotToArm) {
  board.answers = false;
  HardwareRig rig = make(analog());
  EXPECT_EQ(rig.fault(), Fault::watchdog);
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::watchdog);
  board.answers = true;
  tick(rig, 12, 12);
  EXPECT_EQ(rig.fault(), Fault::none);
}

// A wait in vain lasts as long as it was told, which may be many ticks.
TEST_F(HardwareRigRealtime, SilenceCountsInTimeNotInCycles) {
  board.descriptor = STDIN_FILENO;
  board.once = true;
  HardwareRig rig = make(analog());
  rig.wait(1'000'000);
  rig.read();
  ASSERT_EQ(rig.fault(), Fault::none);
  int cycles = 0;
  for (; cycles < 100 && rig.fault() == Fault::none; ++cycles) {
    EXPECT_EQ(rig.wait(20'000'000), 0);
    rig.read();
  }
  EXPECT_EQ(cycles, 3) << "of 20 ms each, where 50 ms are allowed";
}

TEST_F(HardwareRigRealtime, ABoardWithoutAClockIsToldOfTicksLeftOut) {
  HardwareRig rig = make(analog());
  tick(rig, 12, 12);
  rig.left_out(17);
  EXPECT_NEAR(tick(rig, 12, 12).t, 19e-3, 1e-12);
  EXPECT_EQ(board.left_out, 17);
  EXPECT_NEAR(tick(rig, 12, 12).t, 20e-3, 1e-12);
  EXPECT_EQ(board.left_out, 17);
}

TEST_F(HardwareRigRealtime, TheTachoIsToldOfEveryTickAndALostOneIsAReasonNotToArm) {
  HardwareOptions o = analog();
  o.tacho = 1;
  HardwareRig rig = make(o);
  tick(rig, 12, 12);
  rig.follow_tacho(TachoTracker({}, 0, 100, 0));
  tick(rig, 12, 12);
  const double before = tick(rig, 12, 12).beta;
  board.reading.tick += 99;
  EXPECT_NEAR(tick(rig, 12, 12).beta - before, 10, 1e-6);
  EXPECT_EQ(rig.fault(), Fault::none);
  for (int k = 0; k < 400; ++k) tick(rig, 12, 12);
  EXPECT_TRUE(rig.tacho()->lost());
  EXPECT_EQ(rig.fault(), kEncoderStuck);
}

}  // namespace
}  // namespace whirl::rt
