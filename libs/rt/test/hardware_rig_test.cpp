// The rig on a clock that the test turns: each read() without a wait() is a tick.
#include "whirl/rt/drivers/hardware_rig.hpp"

#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/rt/drivers/angle_tracker.hpp"
#include "whirl/rt/drivers/optoncdt_line.hpp"
#include "whirl/rt/faults.hpp"

namespace whirl::rt {
namespace {

/// What the test says is what the board says.
struct FakeBoard : Board {
  struct State {
    BoardReading reading;
    bool answers = true, online = true;
    int descriptor = -1;
    BoardCommand written;
  };
  explicit FakeBoard(State& s) : state(s) {}
  State& state;
  bool read(BoardReading& out) noexcept override {
    if (!state.answers) return false;
    ++state.reading.tick;
    out = state.reading;
    return true;
  }
  void write(const BoardCommand& c) noexcept override { state.written = c; }
  bool connected() const noexcept override { return state.online; }
  int descriptor() const noexcept override { return state.descriptor; }
};

HardwareOptions analog() {
  HardwareOptions o;
  o.position[0].analog = 0;
  o.position[1].analog = 2;
  return o;
}

double volts(double milliampere, double shunt = 250) { return 1e-3 * milliampere * shunt; }

struct HardwareRigRealtime : ::testing::Test {
  FakeBoard::State board;
  HardwareRig make(const HardwareOptions& o) { return HardwareRig(o, std::make_unique<FakeBoard>(board)); }
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

/// A laser whose frames the test sends one by one.
class HandLaser {
 public:
  const std::string& device() const { return line_.device(); }
  /// Streams while `make` runs, so that the start-up of the driver succeeds.
  template <class Make>
  static auto start(HandLaser& a, HandLaser& b, Make&& make) {
    std::atomic<bool> over{false};
    std::thread answering([&] {
      while (!over) {
        for (HandLaser* l : {&a, &b}) l->line_.answer(), l->send(32760), l->line_.flush();
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
    });
    auto rig = make();
    over = true;
    answering.join();
    return rig;
  }
  void send(std::uint32_t raw) { line_.send(raw, number_++); }
  /// Hands over what was sent, and waits until it lies in the driver's line.
  void deliver(const optoncdt::Sensor& sensor, int frames) {
    line_.flush();
    int waiting = 0;
    for (int i = 0; i < 100000; ++i) {
      if (::ioctl(sensor.descriptor(), FIONREAD, &waiting) == 0 && waiting >= 6 * frames) return;
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    FAIL() << "the line does not carry";
  }

 private:
  optoncdt::DeviceLine line_;
  std::uint64_t number_ = 1;
};

struct LaserRigRealtime : ::testing::Test {
  FakeBoard::State board;
  HandLaser x, y;
  std::unique_ptr<HardwareRig> rig;
  std::uint32_t wiggle = 0;

  explicit LaserRigRealtime(int descriptor = -1) {
    board.descriptor = descriptor;
    HardwareOptions o;
    for (std::size_t i = 0; i < 2; ++i) {
      o.position[i].laser.device = (i == 0 ? x : y).device();
      o.position[i].laser.timeout = 30;
      o.position[i].offset = 5e-3;
    }
    o.position[1].direction = -1;
    rig = HandLaser::start(x, y, [&] { return std::make_unique<HardwareRig>(o, std::make_unique<FakeBoard>(board)); });
    // What was on its way while the driver started.
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (int k = 0; k < 50; ++k) tick(32760, 32760);
    rig->arm(true);
  }
  /// Four frames of each laser, then the cycle; 0: the laser is silent.
  Measurement tick(std::uint32_t of_x, std::uint32_t of_y) {
    for (int i = 0; i < 2; ++i) {
      HandLaser& laser = i == 0 ? x : y;
      const std::uint32_t raw = i == 0 ? of_x : of_y;
      if (raw == 0) continue;
      for (int k = 0; k < 4; ++k) laser.send(raw < 262000 ? raw + ++wiggle % 2 : raw);
      laser.deliver(*rig->laser(i), 4);
    }
    return rig->read();
  }
};

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

}  // namespace
}  // namespace whirl::rt
