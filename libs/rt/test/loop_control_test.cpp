#include "whirl/rt/loop_control.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

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

/// A clock that has a fault of its own.
struct LateClock : SimulatedClock {
  LateClock() noexcept : SimulatedClock(1e-3) {}
  Fault fault() const noexcept { return reason; }
  Fault reason = Fault::none;
};

TEST(ControlledClockRealtime, APersonsTripComesBeforeWhateverTheClockFinds) {
  for (const Fault own : {Fault::none, Fault::overrun, Fault::watchdog}) {
    LoopControl control;
    ControlledClock<LateClock> clock(control);
    clock.reason = own;
    EXPECT_EQ(clock.fault(), own);
    control.trip();
    EXPECT_EQ(clock.fault(), Fault::requested);
    EXPECT_EQ(clock.own_fault(), own);
  }
}

// The machine stays late: the force fades, until a person wants it to be zero now.
TEST(ControlledClockRealtime, APersonsTripEndsTheFadingOfAMachineThatStaysLate) {
  StillRig rig;
  ConstantLaw law;
  LoopControl control;
  ControlledClock<LateClock> clock(control);
  Loop loop(rig, law, clock, {}, {.sample_time = 1e-3, .release = 1500});
  for (int k = 0; k < 100; ++k) loop.cycle();
  clock.reason = Fault::overrun;
  EXPECT_EQ(loop.cycle().trip, Fault::overrun);
  EXPECT_TRUE(loop.cycle().releasing);
  EXPECT_GT(rig.written.ux, 3);
  control.trip();
  const CycleRecord r = loop.cycle();
  EXPECT_FALSE(r.releasing);
  EXPECT_EQ(r.sent.ux, 0);
  EXPECT_EQ(r.trip, Fault::overrun) << "the first reason stays";
}

TEST_F(LoopControlRealtime, ATripGivenAfterAClearStays) {
  control.clear();
  control.trip();
  EXPECT_EQ(cycle().sent.ux, 0);
  control.arm();
  EXPECT_EQ(cycle().sent.ux, 0);
  EXPECT_TRUE(control.tripped());
}

TEST_F(LoopControlRealtime, ATripTakenBackBeforeTheLoopSawItActsInTheVeryCycleToo) {
  cycle();
  control.apply(loop, []() noexcept {});
  control.trip();
  control.clear();
  control.arm();
  EXPECT_EQ(loop.cycle().sent.ux, 0) << "the loop was waiting for its tick";
  EXPECT_EQ(cycle().sent.ux, 4);
  EXPECT_EQ(law.resets, 1);
}

/// What a loop does at last with wishes `what`, four of them, that it looks at after each one whose bit is set in
/// `looks`, and at the end.
struct WishOutcome {
  double before, after;
  bool armed, tripped;
  bool operator==(const WishOutcome&) const = default;
};
WishOutcome outcome_of_wishes(int start, unsigned what, unsigned looks) {
  StillRig rig;
  ConstantLaw law;
  LoopControl control;
  ControlledClock<SimulatedClock> clock(control, 1e-3);
  Loop loop(rig, law, clock, {}, {.armed = start != 0});
  if (start == 2) loop.stop(Fault::stale_sensor);
  loop.cycle();
  const auto look = [&] { control.apply(loop, []() noexcept {}); };
  for (unsigned k = 0; k < 4; ++k) {
    switch (what >> 2 * k & 3) {
      case 0:
        control.trip();
        break;
      case 1:
        control.arm();
        break;
      case 2:
        control.disarm();
        break;
      default:
        control.clear();
    }
    if ((looks >> k & 1) != 0) look();
  }
  look();
  WishOutcome out{};
  out.before = loop.cycle().sent.ux;
  out.armed = loop.armed();
  out.tripped = control.tripped();
  control.arm();
  look();
  out.after = loop.cycle().sent.ux;
  return out;
}

TEST(LoopControlOrderRealtime, TheOrderOfTheWishesDecidesWheneverTheLoopLooks) {
  for (const int start : {0, 1, 2}) {
    for (unsigned what = 0; what < 256; ++what) {
      const WishOutcome one_by_one = outcome_of_wishes(start, what, 15);
      for (unsigned looks = 0; looks < 15; ++looks)
        ASSERT_EQ(outcome_of_wishes(start, what, looks), one_by_one)
            << "start " << start << ", wishes " << what << ", looks " << looks;
    }
  }
}

TEST(LoopControlOrderRealtime, ATripIsNeverLostToALoopThatTakesAClearAtThatMoment) {
  StillRig rig;
  ConstantLaw law;
  LoopControl control;
  ControlledClock<SimulatedClock> clock(control, 1e-3);
  Loop loop(rig, law, clock);
  std::atomic<long> looks{0};
  std::jthread thread([&](const std::stop_token& over) {
    for (; !over.stop_requested(); ++looks) control.apply(loop, []() noexcept {});
  });
  long lost = 0;
  for (int k = 0; k < 300; ++k) {
    control.clear();
    control.trip();
    const long seen = looks;
    while (looks < seen + 2) std::this_thread::yield();
    lost += !control.tripped();
  }
  EXPECT_EQ(lost, 0);
}

}  // namespace
}  // namespace whirl::rt
