// What is thrown in the thread of the loop: operator new of this program fails there on demand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "whirl/hardware/rig_server.hpp"
#include "whirl/hardware/run_loop.hpp"
#include "whirl/testing/error_of.hpp"

namespace {
std::atomic<bool> loop_fails{false};
thread_local bool spared = false;
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (loop_fails && !spared) throw std::bad_alloc();
  if (void* p = std::malloc(size > 0 ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace whirl::hardware {
namespace {

/// Remembers the last command.
struct SilentBoard : rt::Board {
  explicit SilentBoard(std::atomic<int>& writes, std::atomic<bool>& at_zero) : writes_(writes), at_zero_(at_zero) {}
  bool read(rt::BoardReading& out) noexcept override {
    out = {.tick = ++tick_, .beta = 0.05 * tick_, .omega = 50, .analog = {3, 3, 0, 0}};
    return true;
  }
  void write(const rt::BoardCommand& c) noexcept override {
    ++writes_;
    at_zero_ = !c.armed && c.volts[0] == 0 && c.volts[1] == 0;
  }
  bool connected() const noexcept override { return true; }
  std::atomic<int>& writes_;
  std::atomic<bool>& at_zero_;
  std::uint32_t tick_ = 0;
};

TEST(LoopFailure, AnExceptionInTheLoopsThreadIsAnErrorWithZeroForceAndNotTheEndOfTheProgram) {
  spared = true;
  IoSettings io;
  io.clock = "wall";
  io.realtime = {.priority = 0, .lock_memory = false, .no_deep_idle = false};
  for (rt::PositionInput& p : io.hardware.position) p.analog = 0;
  std::atomic<int> writes{0};
  std::atomic<bool> at_zero{false};
  rt::HardwareRig rig(io.hardware, std::make_unique<SilentBoard>(writes, at_zero));
  rig.arm(true);
  rig.write({5, 5});
  ASSERT_FALSE(at_zero);
  loop_fails = true;
  const std::string error = testing::error_of([&] { run_loop(io, rig, nullptr, {}); });
  loop_fails = false;
  EXPECT_EQ(error, "the loop ended by an error: std::bad_alloc");
  EXPECT_TRUE(at_zero);
}

// What looks at the cycles afterwards: the rotor stays held to the end, then it is told.
TEST(LoopFailure, AnExceptionOfWhoLooksAtTheCyclesIsToldAtTheEnd) {
  IoSettings io;
  io.clock = "wall";
  io.realtime = {.priority = 0, .lock_memory = false, .no_deep_idle = false};
  io.hardware.stuck = 0;
  for (rt::PositionInput& p : io.hardware.position) p.analog = 0;
  std::atomic<int> writes{0};
  std::atomic<bool> at_zero{false};
  rt::HardwareRig rig(io.hardware, std::make_unique<SilentBoard>(writes, at_zero));
  long seen = 0;
  LoopRunOptions options;
  options.seconds = 0.3;
  options.take = [&](const rt::LoopSample&) {
    if (++seen == 10) throw std::runtime_error("the disk is full");
  };
  const std::string error = testing::error_of([&] { run_loop(io, rig, nullptr, options); });
  EXPECT_EQ(error, "the disk is full");
  EXPECT_GT(seen, 10) << "it ran on, as fast as this machine lets it";
  EXPECT_TRUE(at_zero);
}

/// Has a clock of its own, which runs from the first command on; then a tick for each command.
struct AnsweringBoard : rt::Board {
  AnsweringBoard() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE)) {}
  ~AnsweringBoard() override { ::close(fd_); }
  bool read(rt::BoardReading& out) noexcept override {
    std::uint64_t count = 0;
    if (::read(fd_, &count, sizeof count) != sizeof count) return false;
    tick_ += static_cast<std::uint32_t>(count);
    out = {.tick = tick_, .beta = 0.05 * tick_, .omega = 50, .analog = {3, 3, 0, 0}};
    out.done = tick_ > 400;
    return true;
  }
  void write(const rt::BoardCommand&) noexcept override {
    const std::uint64_t ticks = tick_ == 0 ? 2 : 1;
    (void)!::write(fd_, &ticks, sizeof ticks);
  }
  bool connected() const noexcept override { return true; }
  int descriptor() const noexcept override { return fd_; }
  int fd_;
  std::uint32_t tick_ = 0;
};

// Neither its first tick nor one after its last is waited for in vain: that would cost the watchdog's time, 10 s here.
TEST(LoopEnd, ARunOverWiresWaitsForNoTickThatCannotCome) {
  IoSettings io;
  io.realtime = {.priority = 0, .lock_memory = false, .no_deep_idle = false};
  io.watchdog = 10;
  io.hardware.stuck = 0;
  io.hardware.board_timeout = io.watchdog;
  for (rt::PositionInput& p : io.hardware.position) p.analog = 0;
  rt::HardwareRig rig(io.hardware, std::make_unique<AnsweringBoard>());
  const auto start = std::chrono::steady_clock::now();
  const LoopOutcome out = run_loop(io, rig, nullptr, {});
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 8);
  EXPECT_EQ(out.reason, "the run is over");
}

}  // namespace
}  // namespace whirl::hardware
