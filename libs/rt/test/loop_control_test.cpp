#include "whirl/rt/loop_control.hpp"

#include <gtest/gtest.h>

#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::rt {
namespace {

struct StillRig {
  Measurement next;
  Command written;
  Measurement read() noexcept { return next; }
  void write(const Command& u) noexcept { written = u; }
  void advance() noexcept {}
};

struct ConstantLaw {
  Command next{4, -4}, told;
  int steps = 0, resets = 0;
  Expected<Command, Fault> step(const Measurement&) noexcept {
    ++steps;
    return next;
  }
  void applied(const Command& u) noexcept { told = u; }
};

/// A trip comes while the loop waits.
struct TripsWhileWaiting : SimulatedClock {
  explicit TripsWhileWaiting(LoopControl& c) noexcept : SimulatedClock(1e-3), wishes(c) {}
  long wait() noexcept {
    if (tick() == at) wishes.trip();
    return SimulatedClock::wait();
  }
  LoopControl& wishes;
  long at = -2;
};

struct LoopControlRealtime : ::testing::Test {
  StillRig rig;
  ConstantLaw law;
  LoopControl control;
  ControlledLaw<ConstantLaw> controlled{law, control};
  ControlledClock<TripsWhileWaiting> clock{control, control};
  Loop<StillRig, ControlledLaw<ConstantLaw>, ControlledClock<TripsWhileWaiting>> loop{rig, controlled, clock};

  CycleRecord cycle() {
    control.apply(loop, [&]() noexcept { ++law.resets; });
    return loop.cycle();
  }
};

TEST_F(LoopControlRealtime, ATripActsInTheVeryCycleItWasWaitedFor) {
  EXPECT_EQ(cycle().sent.ux, 4);
  clock.at = 0;
  const CycleRecord r = cycle();
  EXPECT_EQ(r.sent.ux, 0);
  EXPECT_EQ(r.trip, Fault::requested);
  EXPECT_EQ(rig.written.uy, 0);
}

TEST_F(LoopControlRealtime, ATripIsLatchedUntilClearedAndThenArmedByHand) {
  cycle();
  control.trip();
  cycle();
  control.arm();
  EXPECT_EQ(cycle().sent.ux, 0) << "armed in spite of the trip";
  EXPECT_FALSE(cycle().armed);
  control.clear();
  EXPECT_EQ(cycle().sent.ux, 0) << "cleared is not armed";
  control.arm();
  EXPECT_EQ(cycle().sent.ux, 4);
  EXPECT_EQ(law.resets, 1);
}

TEST_F(LoopControlRealtime, ATripWhileDisarmedIsLatchedToo) {
  control.disarm();
  EXPECT_EQ(cycle().sent.ux, 0);
  control.trip();
  control.arm();
  EXPECT_EQ(cycle().sent.ux, 0);
  EXPECT_FALSE(loop.armed());
}

TEST_F(LoopControlRealtime, DisarmWinsOverArmAndIsNoTrip) {
  control.arm();
  control.disarm();
  const CycleRecord r = cycle();
  EXPECT_EQ(r.sent.ux, 0);
  EXPECT_EQ(r.trip, Fault::none);
  control.arm();
  control.clear();
  EXPECT_EQ(cycle().sent.ux, 4) << "cleared first, then armed";
}

TEST_F(LoopControlRealtime, TheForceLimitActsAndTheLawIsTold) {
  control.set_force_limit(1.5);
  const CycleRecord r = cycle();
  EXPECT_EQ(r.sent.ux, 1.5);
  EXPECT_EQ(r.sent.uy, -1.5);
  EXPECT_EQ(law.told.ux, 1.5);
  control.set_force_limit(5);
  EXPECT_EQ(cycle().sent.ux, 4);
}

}  // namespace
}  // namespace whirl::rt
