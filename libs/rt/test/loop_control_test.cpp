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

/// Asks for what it is told to ask for.
struct AskingLaw {
  Expected<Command, Fault> asks = Command{};
  int told = 0;
  Expected<Command, Fault> step(const Measurement&) noexcept { return asks; }
  void applied(const Command&) noexcept { ++told; }
};

TEST(ControlledLawRealtime, EachAxisToBothSidesIsKeptWithinThePersonsLimit) {
  LoopControl control;
  control.set_force_limit(2);
  AskingLaw law;
  ControlledLaw<AskingLaw> limited(law, control);
  const auto ask = [&](double ux, double uy) {
    law.asks = Command{ux, uy};
    return *limited.step({});
  };
  for (const double sign : {1.0, -1.0}) {
    law.told = 0;
    EXPECT_EQ(ask(sign * 3, sign * 0.5).ux, sign * 2);
    EXPECT_EQ(ask(sign * 3, sign * 0.5).uy, sign * 0.5);
    EXPECT_EQ(ask(sign * 0.5, sign * 3).uy, sign * 2);
    EXPECT_EQ(ask(sign * 0.5, sign * 3).ux, sign * 0.5);
    EXPECT_EQ(law.told, 4);
    EXPECT_EQ(ask(sign * 2, sign * 1).ux, sign * 2);
    EXPECT_EQ(ask(sign * 1, sign * 2).uy, sign * 2);
    EXPECT_EQ(law.told, 4) << "the limit itself is no limiting";
  }
  law.asks = Expected<Command, Fault>::fault(Fault::not_finite);
  const auto refused = limited.step({});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error(), Fault::not_finite);
  EXPECT_EQ(law.told, 4);
}

}  // namespace
}  // namespace whirl::rt
