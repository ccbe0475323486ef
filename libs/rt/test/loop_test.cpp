#include "whirl/rt/loop.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "whirl/rt/clock.hpp"
#include "whirl/testing/alloc_guard.hpp"

namespace whirl::rt {
namespace {

struct FakeRig {
  Measurement next;
  Command written{1, 1};
  long advanced = 0;
  Measurement read() const noexcept { return next; }
  void write(const Command& c) noexcept { written = c; }
  void advance() noexcept { ++advanced; }
};

struct FakeController {
  Expected<Command, Fault> next = Command{};
  Command applied_last{};
  long steps = 0, corrections = 0;
  Expected<Command, Fault> step(const Measurement&) noexcept { return ++steps, next; }
  void applied(const Command& c) noexcept { applied_last = c, ++corrections; }
};

struct LoopRealtime : ::testing::Test {
  FakeRig rig;
  FakeController controller;
  SimulatedClock clock{1e-3};
};

TEST_F(LoopRealtime, OneCycleReadsStepsWritesAdvances) {
  Loop loop(rig, controller, clock);
  controller.next = Command{2, -3};
  const testing::AllocationGuard guard;
  const CycleRecord r = loop.cycle();
  EXPECT_EQ(guard.count(), 0u);
  EXPECT_EQ(r.tick, 0);
  EXPECT_EQ(rig.written.uy, -3);
  EXPECT_EQ(rig.advanced, 1);
  EXPECT_EQ(controller.corrections, 0);
  EXPECT_EQ(loop.cycle().tick, 1);
  EXPECT_DOUBLE_EQ(clock.now(), 1e-3);
}

TEST_F(LoopRealtime, LimitsForceAndSlewAndTellsTheController) {
  Loop loop(rig, controller, clock, {.force = 5, .slew = 2});
  controller.next = Command{100, -1};
  EXPECT_TRUE(loop.cycle().limited);
  EXPECT_EQ(rig.written.ux, 2);
  EXPECT_EQ(rig.written.uy, -1);
  EXPECT_EQ(controller.applied_last.ux, 2);
  loop.cycle();
  loop.cycle();
  EXPECT_EQ(rig.written.ux, 5);
}

TEST_F(LoopRealtime, TripLatchesWithReasonAndTickUntilCleared) {
  Loop loop(rig, controller, clock, {.displacement = 1e-3});
  controller.next = Command{1, 1};
  loop.cycle();
  rig.next.x = 2e-3;
  EXPECT_EQ(loop.cycle().trip, Fault::displacement_limit);
  EXPECT_EQ(rig.written.ux, 0);
  rig.next.x = 0;
  controller.next = Expected<Command, Fault>::fault(Fault::stale_sensor);  // a later fault does not replace the first
  EXPECT_EQ(loop.cycle().trip, Fault::displacement_limit);
  EXPECT_EQ(loop.safety().trip_tick, 1);
  EXPECT_EQ(controller.steps, 2) << "a tripped loop asks the controller no more";
  EXPECT_FALSE(loop.arm()) << "no way back before the trip is cleared";
  loop.clear();
  controller.next = Command{1, 1};
  EXPECT_EQ(loop.cycle().trip, Fault::none);
  EXPECT_EQ(rig.written.ux, 0) << "cleared is not armed";
  EXPECT_TRUE(loop.arm());
  EXPECT_EQ(loop.cycle().trip, Fault::none);
  EXPECT_EQ(rig.written.ux, 1);
}

TEST_F(LoopRealtime, EveryReasonGivesZero) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const SafetyLimits limits{.displacement = 1e-3, .stale = 2};
  const auto reason = [&](const Measurement& m, const Expected<Command, Fault>& request,
                          const SafetyState& state = {}) {
    const SafetyDecision d = decide(limits, state, m, request, 7);
    EXPECT_TRUE(d.state.trip == Fault::none || (d.command.ux == 0 && d.command.uy == 0));
    return d.state.trip;
  };
  Measurement fine, wide, odd, lost;
  wide.y = -2e-3, odd.x = nan, lost.valid = false, lost.x = 1;
  EXPECT_EQ(reason(fine, Command{1, 1}), Fault::none);
  EXPECT_EQ(reason(wide, Command{1, 1}), Fault::displacement_limit);
  EXPECT_EQ(reason(odd, Command{1, 1}), Fault::not_finite);
  EXPECT_EQ(reason(fine, Command{nan, 1}), Fault::not_finite);
  EXPECT_EQ(reason(fine, Expected<Command, Fault>::fault(Fault::watchdog)), Fault::watchdog);
  EXPECT_EQ(reason(lost, Command{1, 1}), Fault::none);
  EXPECT_EQ(reason(lost, Command{1, 1}, {Fault::none, -1, 2, {}}), Fault::stale_sensor);
}

TEST_F(LoopRealtime, EndsWithZeroForce) {
  {
    Loop loop(rig, controller, clock);
    controller.next = Command{4, 4};
    loop.cycle();
    EXPECT_EQ(rig.written.ux, 4);
  }
  EXPECT_EQ(rig.written.ux, 0);
}

TEST_F(LoopRealtime, StopIsATrip) {
  Loop loop(rig, controller, clock);
  controller.next = Command{4, 4};
  loop.stop();
  EXPECT_EQ(loop.cycle().trip, Fault::requested);
  EXPECT_EQ(rig.written.ux, 0);
}

}  // namespace
}  // namespace whirl::rt
