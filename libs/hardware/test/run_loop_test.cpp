// How a loop begins and ends: signals, boards that are silent, late, lost or out of step, a stderr that fails.
#include "whirl/hardware/run_loop.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <functional>

#include "whirl/control/controller.hpp"
#include "whirl/testing/designs.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::hardware {
namespace {

/// What a board did, and what it does.
struct BoardLife {
  long commands = 0, armed = 0;
  std::function<bool(long command)> answers = [](long) { return true; };
  std::function<std::uint32_t(std::uint32_t tick)> shown = [](std::uint32_t tick) { return tick; };
  std::atomic<bool> lost{false};
};

/// A tick for each command that it answers; `waits`: the loop waits for it.
class CountedBoard : public rt::Board {
 public:
  CountedBoard(BoardLife& life, bool waits)
      : life_(life), fd_(waits ? ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE) : -1) {}
  ~CountedBoard() override {
    if (fd_ >= 0) ::close(fd_);
  }
  bool read(rt::BoardReading& out) noexcept override {
    std::uint64_t count = 1;
    if (life_.lost || (fd_ >= 0 ? ::read(fd_, &count, sizeof count) != sizeof count : !life_.answers(life_.commands)))
      return false;
    tick_ += static_cast<std::uint32_t>(count);
    const double noise = 1e-9 * tick_;
    out = {.tick = life_.shown(tick_), .beta = 0.05 * tick_, .omega = 50, .analog = {3.2 + noise, 3 + noise, 0, 0}};
    return true;
  }
  void write(const rt::BoardCommand& c) noexcept override {
    ++life_.commands;
    life_.armed += c.armed;
    const std::uint64_t ticks = life_.commands == 1 ? 2 : 1;
    if (fd_ >= 0 && life_.answers(life_.commands)) (void)!::write(fd_, &ticks, sizeof ticks);
  }
  bool connected() const noexcept override { return !life_.lost; }
  Fault loss() const noexcept override { return rt::kBoardLost; }
  int descriptor() const noexcept override { return fd_; }

 private:
  BoardLife& life_;
  int fd_;
  std::uint32_t tick_ = 0;
};

struct RunLoop : ::testing::Test {
  RunLoop() {
    io.realtime = {.priority = 0, .lock_memory = false, .no_deep_idle = false};
    for (std::size_t i = 0; i < 2; ++i) {
      io.hardware.position[i].analog = static_cast<int>(i);
      io.hardware.position[i].laser.range = 0.01;
      io.hardware.position[i].offset = 5e-3;
    }
    io.hardware.stuck = 0;
  }
  LoopOutcome run(bool controlled, const LoopRunOptions& options) {
    io.hardware.board_timeout = io.watchdog;
    rt::HardwareRig rig(io.hardware, std::make_unique<CountedBoard>(life, io.clock != "wall"));
    return run_loop(io, rig, controlled ? &controller : nullptr, options);
  }
  IoSettings io;
  BoardLife life;
  control::Controller controller = control::make_controller(testing::design_of("pd", "lpf"));
};

std::atomic<int> asked{0}, until{0};
bool stop_later() noexcept { return asked++ >= until; }

TEST_F(RunLoop, ASignalBeforeOrDuringTheSettlingArmsNothing) {
  for (const char* clock : {"wall", "sample"}) {
    for (const int later : {0, 1, 50}) {
      for (const bool controlled : {true, false}) {
        asked = 0, until = later;
        life.armed = 0;
        io.clock = clock;
        long seen = 0;
        const LoopOutcome out =
            run(controlled, {.seconds = 10, .take = [&](const rt::LoopSample&) { ++seen; }, .stop = stop_later});
        EXPECT_FALSE(out.armed);
        EXPECT_EQ(life.armed, 0) << clock << ", " << later;
        EXPECT_EQ(seen, 0);
        EXPECT_EQ(out.reason, "stopped by a signal");
      }
    }
  }
}

TEST_F(RunLoop, NothingIsArmedThatWasNeverSeen) {
  io.clock = "wall";
  io.settle = 0;
  life.answers = [](long command) { return command > 20; };
  const LoopOutcome out = run(true, {.seconds = 0.05});
  EXPECT_FALSE(out.armed);
  EXPECT_EQ(life.armed, 0);
}

// Each cycle waits for the watchdog's time: a hundred of them would last ten seconds here.
TEST_F(RunLoop, ABoardThatNeverAnswersIsNotWaitedForInEveryCycle) {
  io.watchdog = 0.1;
  life.answers = [](long) { return false; };
  for (const bool controlled : {true, false}) {
    const LoopOutcome out = run(controlled, {.seconds = 10, .patience = 0.2});
    EXPECT_EQ(out.reason, "the board does not answer");
    EXPECT_LT(life.commands, 30);
  }
  EXPECT_EQ(life.armed, 0);
}

TEST_F(RunLoop, ABoardThatComesLateIsWaitedFor) {
  io.watchdog = 0.1;
  life.answers = [](long command) { return command > 6; };
  const LoopOutcome out = run(true, {.seconds = 0.1});
  EXPECT_TRUE(out.armed) << out.reason;
  EXPECT_EQ(out.reason, "the time is over");
}

TEST_F(RunLoop, WithoutAControllerASilentOrLostBoardEndsTheRecording) {
  io.watchdog = 0.02;
  for (const bool lost : {false, true}) {
    life.lost = false;
    const long before = life.commands;
    long valid = 0, rows = 0;
    life.answers = [&](long command) {
      if (command - before > 200) life.lost = lost;
      return command - before <= 200;
    };
    const auto take = [&](const rt::LoopSample& s) { ++rows, valid += (s.flags & rt::kValid) != 0; };
    const LoopOutcome out = run(false, {.seconds = 0.4, .take = take, .patience = 0.2});
    EXPECT_EQ(out.reason, "the board does not answer") << rows << " rows";
    EXPECT_TRUE(out.cut_short);
    EXPECT_GT(rows, 90);
    EXPECT_LT(rows, 150);
    EXPECT_LT(valid, 105) << "what a silent board said last is no sample";
  }
}

TEST_F(RunLoop, AClockOfTheBoardThatIsSetForwardDoesNotEndATimedRecording) {
  life.shown = [](std::uint32_t tick) { return tick < 150 ? tick : tick + 100000; };
  long rows = 0;
  const LoopOutcome out = run(false, {.seconds = 0.3, .take = [&](const rt::LoopSample&) { ++rows; }});
  EXPECT_EQ(out.reason, "the time is over");
  EXPECT_GE(rows, 290);
  EXPECT_GE(out.timing.missed, 100000) << "they are told as left out";
}

/// stderr leads elsewhere while this lives.
class StderrInto {
 public:
  explicit StderrInto(int fd) : before_(::dup(2)) { ::dup2(fd, 2), ::close(fd); }
  ~StderrInto() { ::dup2(before_, 2), ::close(before_); }

 private:
  int before_;
};

TEST_F(RunLoop, AnStderrThatFailsEndsNeitherTheLoopNorTheProgram) {
  for (const bool pipe : {false, true}) {
    long seen = 0;
    std::string error;
    {
      int ends[2];
      ASSERT_EQ(::pipe(ends), 0);
      const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
      ASSERT_GE(full, 0);
      ::close(ends[0]);
      const StderrInto nowhere(pipe ? ends[1] : full);
      ::close(pipe ? full : ends[1]);
      const auto take = [&](const rt::LoopSample&) {
        if (++seen == 10) throw Error("the disk is full");
        // What somebody else says meanwhile.
        if (seen == 20) (void)!::write(2, "x", 1);
      };
      error = testing::error_of([&] { run(true, {.seconds = 0.3, .take = take}); });
    }
    EXPECT_EQ(error, "the disk is full");
    EXPECT_GE(seen, 300) << (pipe ? "closed pipe" : "full disk");
    EXPECT_EQ(std::signal(SIGPIPE, SIG_DFL), SIG_DFL) << "only while the loop runs";
  }
}

TEST_F(RunLoop, WhatFailsWhenTheLoopIsToldToHaveStartedDoesNotEndIt) {
  long seen = 0;
  LoopRunOptions options;
  options.seconds = 0.1;
  options.take = [&](const rt::LoopSample&) { ++seen; };
  options.started = [](const LoopOutcome&) { throw Error("no page"); };
  EXPECT_EQ(testing::error_of([&] { run(true, options); }), "no page");
  EXPECT_GE(seen, 100);
}

}  // namespace
}  // namespace whirl::hardware
