// The tests of the channels that send a force to a shaft at rest, on a board that the test plays.
#include "whirl/hardware/at_rest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <optional>

#include "whirl/hardware/sensitivity.hpp"
#include "whirl/hardware/survey.hpp"
#include "whirl/rt/drivers/angle_tracker.hpp"
#include "whirl/testing/designs.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::hardware {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kRound = 2 * std::numbers::pi;

/// A board that goes on by a tick with each command, and what it was told.
struct ShaftBoard : rt::Board {
  struct State {
    double beta = 0, omega = 0;      ///< rad, rad/s
    double turns = 0, per_turn = 1;  ///< turns a second of a shaft with marks on input 2
    bool answers = true;
    long jumps_after = 1 << 30, jump = 0, ahead = 0;  ///< its clock is set forward
    long armed = 0, tick = 0;                         ///< commands with force; ticks
    bool at_zero = true;                              ///< the last command was a disarmed zero
  };
  explicit ShaftBoard(State& s) : state(s), fd(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE)) {}
  ~ShaftBoard() override { ::close(fd); }
  bool read(rt::BoardReading& out) noexcept override {
    std::uint64_t count = 0;
    if (!state.answers || ::read(fd, &count, sizeof count) != sizeof count) return false;
    ++state.tick;
    const double noise = 1e-6 * static_cast<double>(state.tick * 37 % 97);
    const double place = state.per_turn * (0.3 + 1e-3 * state.turns * static_cast<double>(state.tick));
    if (state.armed > state.jumps_after) state.ahead = state.jump;
    out = {.tick = static_cast<std::uint32_t>(state.tick + state.ahead),
           .beta = state.beta,
           .omega = state.omega,
           .analog = {3 + noise, 3 - noise, place - std::floor(place) < 0.2 ? 4.8 : 0.1 + noise, 0}};
    return true;
  }
  void write(const rt::BoardCommand& c) noexcept override {
    state.armed += c.armed && (c.volts[0] != 0 || c.volts[1] != 0);
    state.at_zero = !c.armed && c.volts[0] == 0 && c.volts[1] == 0;
    const std::uint64_t ticks = asked ? 1 : 2;
    asked = true;
    (void)!::write(fd, &ticks, sizeof ticks);
  }
  bool connected() const noexcept override { return true; }
  int descriptor() const noexcept override { return fd; }
  State& state;
  int fd;
  bool asked = false;
};

struct AtRest : ::testing::Test {
  void SetUp() override {
    io.realtime = {.priority = 0, .lock_memory = false, .no_deep_idle = false};
    io.watchdog = 10;
    io.hardware.board_timeout = io.watchdog;
    for (int i = 0; i < 2; ++i) {
      rt::PositionInput& p = io.hardware.position[static_cast<std::size_t>(i)];
      p.analog = i;
      p.laser.range = 25e-3;
      p.offset = 12.5e-3;
    }
    io.safety.displacement = 5e-3;
    io.safety.force = 40;
    asked = 0, most_asked = 1 << 30;
  }
  OpenRig open() {
    return [this]() -> rt::HardwareRig& { return rig.emplace(io.hardware, std::make_unique<ShaftBoard>(board)); };
  }
  LoopSurvey surveyed(double excitation) { return survey(io, open(), 0.5, excitation, stop); }
  LoopSensitivity measured() { return measure_sensitivity(io, open(), testing::design_of("pd", "lpf"), 12, 0.5, stop); }
  static bool stop() noexcept { return ++asked > most_asked; }
  static inline long asked, most_asked;  ///< a signal comes after so many cycles
  IoSettings io;
  ShaftBoard::State board;
  std::optional<rt::HardwareRig> rig;
};

TEST_F(AtRest, AStopWhileTheShaftIsExcitedTakesTheForceAway) {
  most_asked = 700;
  const LoopSurvey s = surveyed(1);
  EXPECT_EQ(s.trip, Fault::requested);
  EXPECT_GT(board.armed, 50);
  EXPECT_LT(board.tick, 900) << "at once";
  EXPECT_TRUE(board.at_zero);
  EXPECT_EQ(s.delay[0].explained, 0);
  EXPECT_THAT(s.summary.warnings, Contains(HasSubstr("stopped by a signal")));
}

TEST_F(AtRest, AStopWhileTheSensitivityIsMeasuredTakesTheForceAway) {
  most_asked = 2000;
  const LoopSensitivity m = measured();
  EXPECT_EQ(m.trip, Fault::requested);
  EXPECT_GT(board.armed, 200);
  EXPECT_LT(board.tick, 2200) << "at once";
  EXPECT_TRUE(board.at_zero);
  EXPECT_NE(m.summary.status, Status::unusable);
  EXPECT_THAT(m.summary.warnings, Contains(HasSubstr("stopped by a signal")));
}

TEST_F(AtRest, AStopBeforeTheForceSendsNone) {
  for (const long at : {0L, 30L, 400L}) {
    board = {};
    asked = 0, most_asked = at;
    EXPECT_EQ(surveyed(1).trip, Fault::requested);
    EXPECT_LT(board.tick, at + 50);
    EXPECT_EQ(board.armed, 0);
    board = {};
    asked = 0, most_asked = at;
    EXPECT_EQ(measured().trip, Fault::requested);
    EXPECT_LT(board.tick, at + 50);
    EXPECT_EQ(board.armed, 0);
  }
}

TEST_F(AtRest, AStopWhileTheMarksAreLearnedEndsTheLearning) {
  io.tacho.analog = io.hardware.tacho = 2;
  board.turns = 9;
  most_asked = 300;
  const LoopSurvey s = surveyed(0);
  EXPECT_EQ(s.trip, Fault::requested);
  EXPECT_LT(board.tick, 400);
}

TEST_F(AtRest, AShaftThatTurnsIsNotExcited) {
  board.omega = 50;
  const LoopSurvey s = surveyed(1);
  EXPECT_EQ(board.armed, 0);
  EXPECT_THAT(s.summary.warnings, Contains(AllOf(HasSubstr("50.0 rad/s"), HasSubstr("come to rest"))));
  EXPECT_GT(s.channel[0].ticks, 400) << "the channels were looked at all the same";
  EXPECT_THAT(testing::error_of([&] { measured(); }), HasSubstr("come to rest"));
  EXPECT_EQ(board.armed, 0);
  board.omega = -0.2;
  EXPECT_EQ(surveyed(1).summary.status, Status::unusable);
  EXPECT_EQ(board.armed, 0);
}

TEST_F(AtRest, ATachoThatGivesPulsesRefusesTheForce) {
  io.tacho.analog = io.hardware.tacho = 2;
  io.tacho.learn = 2.6;
  // The one mark of a shaft that creeps passes once in that time; forty of a fast one are too many to be learned.
  for (const auto& [marks, turns] : {std::pair(1.0, 0.4), std::pair(40.0, 9.0)}) {
    SCOPED_TRACE(marks);
    board = {};
    board.per_turn = marks, board.turns = turns;
    EXPECT_THAT(surveyed(1).summary.warnings, Contains(AllOf(HasSubstr("tacho"), HasSubstr("come to rest"))));
    EXPECT_THAT(testing::error_of([&] { measured(); }), AllOf(HasSubstr("tacho"), HasSubstr("come to rest")));
    EXPECT_EQ(board.armed, 0);
  }
  board = {};
  EXPECT_NE(surveyed(1).summary.warnings.size(), 0u) << "a force that moves nothing";
  EXPECT_GT(board.armed, 500) << "at rest";
}

// What is left of it a filter never forgets entirely.
TEST_F(AtRest, AnEncoderThatDithersByOneCountIsAtRest) {
  board.omega = 1e-17;
  EXPECT_NO_THROW(measured());
  EXPECT_GT(board.armed, 0);
  // The worst that a square wave of one count makes of the filter of 5 Hz at 1 kHz.
  double most = 0;
  for (int half = 1; half < 400; half += half / 20 + 1) {
    rt::AngleTracker tracker(4096, 5, 1e-3);
    for (int k = 0; k < 4000; ++k) tracker.update(k / half % 2), most = std::max(most, std::abs(tracker.omega()));
  }
  board.omega = most;
  board.armed = 0;
  surveyed(1);
  EXPECT_GT(board.armed, 0) << most;
}

// A board that starts anew may seem to have left out any number of ticks.
TEST_F(AtRest, ClocksThatJumpWhileTheShaftIsExcitedCostNoMemory) {
  const auto most_memory = [] {
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    return used.ru_maxrss;  // KiB
  };
  board.jumps_after = 100, board.jump = 10'000'000;
  const long before = most_memory();
  const LoopSurvey s = surveyed(1);
  EXPECT_NE(s.trip, Fault::none);
  EXPECT_TRUE(board.at_zero);
  EXPECT_LT(most_memory() - before, 40'000);
}

TEST(BoardSilence, EndsAfterFiveSecondsOfRealTimeHoweverFewTheCyclesWere) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  BoardSilence silence(100 * kSecond);
  EXPECT_FALSE(silence.too_long(0, 105 * kSecond));
  EXPECT_TRUE(silence.too_long(0, 105 * kSecond + 1));
  EXPECT_FALSE(silence.too_long(7, 110 * kSecond)) << "it speaks";
  EXPECT_FALSE(silence.too_long(7, 114 * kSecond));
  EXPECT_TRUE(silence.too_long(7, 120 * kSecond));
}

// Each cycle waits for 3 s here: settling would take five minutes.
TEST_F(AtRest, ASilentBoardEndsTheTestOfTheChannels) {
  io.watchdog = io.hardware.board_timeout = 3;
  board.answers = false;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT(surveyed(1).summary.reason, HasSubstr("no readings"));
  EXPECT_THAT(testing::error_of([&] { measured(); }), HasSubstr("the board does not answer"));
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 60);
  EXPECT_EQ(board.armed, 0);
}

}  // namespace
}  // namespace whirl::hardware
