// What is thrown in the thread of the loop: operator new of this program fails there on demand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
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
  EXPECT_GT(seen, 100) << "it ran on";
  EXPECT_TRUE(at_zero);
}

}  // namespace
}  // namespace whirl::hardware
