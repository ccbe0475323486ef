// Every clause of the gate by itself, on both axes: each test fails when the clause is left out.
#include "whirl/rt/safety.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::rt {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();

SafetyDecision ask(const SafetyLimits& limits, const Command& request, const SafetyState& state = {},
                   const Measurement& m = {}, Fault outside = Fault::none) {
  return decide(limits, state, m, request, 3, outside);
}

TEST(SafetyGateRealtime, ForceIsLimitedOnEachAxisToBothSides) {
  const SafetyLimits limits{.force = 5};
  for (const double sign : {1.0, -1.0}) {
    const SafetyDecision x = ask(limits, {sign * 7, 1}), y = ask(limits, {1, sign * 7});
    EXPECT_EQ(x.command.ux, sign * 5);
    EXPECT_EQ(x.command.uy, 1);
    EXPECT_EQ(y.command.uy, sign * 5);
    EXPECT_EQ(y.command.ux, 1);
    EXPECT_TRUE(x.limited && y.limited);
    EXPECT_EQ(y.state.last.uy, sign * 5) << "what was sent is remembered";
  }
  EXPECT_FALSE(ask(limits, {5, -5}).limited);
  EXPECT_EQ(ask({.force = 0}, {1e9, 0}).command.ux, 1e9) << "0 is no limit";
  EXPECT_FALSE(ask({.force = 0}, {1e9, 0}).limited);
  EXPECT_FALSE(ask({}, {1, 1}, {}, {}, Fault::watchdog).limited) << "a trip is no limit";
}

TEST(SafetyGateRealtime, SlewOfEachAxisCountsFromItsOwnLastForce) {
  const SafetyLimits limits{.slew = 2};
  const SafetyState at{.last = {10, -20}};
  const SafetyDecision up = ask(limits, {100, 100}, at), down = ask(limits, {-100, -100}, at);
  EXPECT_EQ(up.command.ux, 12);
  EXPECT_EQ(up.command.uy, -18);
  EXPECT_EQ(down.command.ux, 8);
  EXPECT_EQ(down.command.uy, -22);
  EXPECT_TRUE(ask(limits, {10, 100}, at).limited);
  EXPECT_TRUE(ask(limits, {100, -20}, at).limited);
  EXPECT_FALSE(ask(limits, {11, -21}, at).limited);
}

TEST(SafetyGateRealtime, WhatIsNoNumberTripsOnEachAxis) {
  for (const double odd : {kNaN, kInf, -kInf}) {
    for (const Command u : {Command{odd, 1}, Command{1, odd}}) {
      const SafetyDecision d = ask({.force = 5, .slew = 1}, u);
      EXPECT_EQ(d.state.trip, Fault::not_finite);
      EXPECT_EQ(d.command.ux, 0);
      EXPECT_EQ(d.command.uy, 0);
    }
  }
  for (const Measurement& m : {Measurement{.x = kNaN}, Measurement{.y = kNaN}})
    EXPECT_EQ(ask({.displacement = 1}, {}, {}, m).state.trip, Fault::not_finite);
  EXPECT_EQ(ask({.displacement = 1}, {}, {}, {.x = kInf}).state.trip, Fault::displacement_limit);
}

TEST(SafetyGateRealtime, DisplacementTripsOnEachAxisToBothSidesOfAValidReading) {
  const SafetyLimits limits{.displacement = 1e-3};
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(ask(limits, {}, {}, {.x = sign * 1.01e-3}).state.trip, Fault::displacement_limit);
    EXPECT_EQ(ask(limits, {}, {}, {.y = sign * 1.01e-3}).state.trip, Fault::displacement_limit);
    EXPECT_EQ(ask(limits, {}, {}, {.x = sign * 1e-3, .y = sign * 1e-3}).state.trip, Fault::none) << "the limit itself";
  }
  EXPECT_EQ(ask(limits, {}, {}, {.x = 1, .valid = false}).state.trip, Fault::none);
  EXPECT_EQ(ask({.displacement = 0}, {}, {}, {.x = 1}).state.trip, Fault::none) << "0 is no limit";
}

TEST(SafetyGateRealtime, LostReadingsAreCountedInARow) {
  const SafetyLimits limits{.stale = 3};
  SafetyState state;
  const Measurement lost{.valid = false};
  for (int k = 1; k <= 3; ++k) {
    state = ask(limits, {1, 1}, state, lost).state;
    EXPECT_EQ(state.invalid, k);
    EXPECT_EQ(state.trip, Fault::none);
  }
  EXPECT_EQ(ask(limits, {1, 1}, state, lost).state.trip, Fault::stale_sensor);
  EXPECT_EQ(ask(limits, {1, 1}, state, {}).state.invalid, 0) << "one valid reading starts anew";
  SafetyState many;
  many.invalid = 1000;
  EXPECT_EQ(ask({.stale = 0}, {1, 1}, many, lost).state.trip, Fault::none) << "0 is never";
}

TEST(SafetyGateRealtime, TheFirstReasonStaysWithItsTick) {
  const SafetyDecision first = ask({}, {1, 1}, {}, {}, Fault::watchdog);
  EXPECT_EQ(first.state.trip, Fault::watchdog);
  EXPECT_EQ(first.state.trip_tick, 3);
  const SafetyDecision later = decide({}, first.state, {}, Command{1, 1}, 9, Fault::overrun);
  EXPECT_EQ(later.state.trip, Fault::watchdog);
  EXPECT_EQ(later.state.trip_tick, 3);
  EXPECT_EQ(later.command.ux, 0);
  EXPECT_EQ(later.command.uy, 0);
  EXPECT_EQ(decide({.displacement = 1}, {}, {.x = 2}, Command{1, 1}, 9, Fault::overrun).state.trip, Fault::overrun)
      << "what came from outside was first";
  SafetyState sent;
  sent.last = {4, 4};
  EXPECT_EQ(decide({.slew = 1}, sent, {}, Command{4, 4}, 9, Fault::overrun).state.last.ux, 0)
      << "zero is what was sent: the slew limit counts from there";
}

TEST(SafetyGateRealtime, AControllerThatRefusesTripsUnlessSomethingElseWasFirst) {
  const auto refused = Expected<Command, Fault>::fault(Fault::stale_sensor);
  EXPECT_EQ(decide({}, {}, {}, refused, 3).state.trip, Fault::stale_sensor);
  EXPECT_EQ(decide({}, {}, {}, refused, 3, Fault::overrun).state.trip, Fault::overrun);
  EXPECT_EQ(decide({.displacement = 1}, {}, {.x = 2}, refused, 3).state.trip, Fault::displacement_limit);
}

TEST(SafetyGateRealtime, OnlyReasonsThatLeaveTheForceTrueMayFade) {
  for (const Fault f : {Fault::stale_sensor, Fault::overrun, Fault::watchdog, Fault::requested, kGap, kEncoderStuck})
    EXPECT_TRUE(may_release(f)) << to_string(f);
  for (const Fault f : {Fault::none, Fault::not_finite, Fault::displacement_limit, kImplausible})
    EXPECT_FALSE(may_release(f)) << to_string(f);
}

// A rotor turning at 10 rad/s, a law whose force turns with it, tripped from outside.
struct SafetyRig {
  long tick = 0;
  Fault reason = Fault::none;
  Command written;
  Measurement read() noexcept {
    const double t = 1e-3 * static_cast<double>(tick++);
    return {.t = t, .beta = 10 * t, .omega = 10};
  }
  void write(const Command& c) noexcept { written = c; }
  void advance() const noexcept {}
  Fault fault() const noexcept { return reason; }
};
struct TurningLaw {
  double amplitude = 8;
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    return Command{amplitude * std::cos(m.beta), amplitude * std::sin(m.beta)};
  }
  void applied(const Command&) noexcept {}
};

TEST(SafetyGateRealtime, TheFadingForceIsLimitedToo) {
  SafetyRig rig;
  TurningLaw law;
  SimulatedClock clock(1e-3);
  // Limited to 3 N by the gate; the fitted synchronous force of a clipped wave is larger than its limit.
  Loop loop(rig, law, clock, {.force = 3}, {.release = 300});
  double fading = 0;
  for (int k = 0; k < 900; ++k) {
    if (k == 700) rig.reason = Fault::stale_sensor;
    const CycleRecord r = loop.cycle();
    EXPECT_LE(std::abs(r.sent.ux), 3);
    EXPECT_LE(std::abs(r.sent.uy), 3);
    if (r.releasing) fading = std::max({fading, std::abs(r.sent.ux), std::abs(r.sent.uy)});
  }
  EXPECT_GT(fading, 2);
}

// Ticks left out as a script says.
struct GapClock {
  long gap = 0;
  long wait() noexcept { return std::exchange(gap, 0); }
};

TEST(GapRealtime, AGapAboveTheLimitTripsWithItsOwnReason) {
  for (const long gap : {0L, 1L, 99L, 100L, 101L, 5000L}) {
    SafetyRig rig;
    TurningLaw law;
    GapClock clock;
    Loop loop(rig, law, clock);
    for (int k = 0; k < 10; ++k) loop.cycle();
    clock.gap = gap;
    const CycleRecord r = loop.cycle();
    EXPECT_EQ(r.trip, gap > 100 ? kGap : Fault::none) << gap;
    EXPECT_EQ(r.missed, gap);
    if (gap > 100) {
      EXPECT_EQ(rig.written.ux, 0);
    }
  }
}

TEST(GapRealtime, TheMotionInAGapIsTheOneBetweenItsEnds) {
  // Accelerating whirl: angle and speed known at the ends only.
  const auto at = [](double t) {
    Measurement m{.t = t, .beta = 60 * t + 20 * t * t, .omega = 60 + 40 * t, .omega_dot = 40};
    const double r = 2e-4 * (1 + 2 * t);
    m.x = r * std::cos(m.beta - 0.7), m.y = r * std::sin(m.beta - 0.7);
    return m;
  };
  for (const double gap : {2e-3, 21e-3, 46e-3, 101e-3}) {
    for (double part = 0; part <= 1; part += 0.125) {
      const Measurement m = bridge(at(0.3), at(0.3 + gap), part), truth = at(0.3 + part * gap);
      EXPECT_NEAR(m.t, truth.t, 1e-12);
      EXPECT_NEAR(m.beta, truth.beta, 1e-9);
      EXPECT_NEAR(m.omega, truth.omega, 1e-9);
      EXPECT_NEAR(m.x, truth.x, 1e-7);
      EXPECT_NEAR(m.y, truth.y, 1e-7);
    }
  }
}

TEST(GapRealtime, FirstCommandsAfterAGapAreBoundedOnEachAxisAndTheBoundEnds) {
  GapBound bound(1e-3);
  Command u;
  for (int k = 0; k < 300; ++k) {
    u = {10 * std::cos(0.1 * k), 6 * std::sin(0.1 * k)};
    EXPECT_FALSE(bound.apply(0, 50, u));
  }
  for (int k = 0; k < 20; ++k) {
    u = {k % 2 ? 50.0 : 0.0, k % 2 ? 0.0 : -50.0};
    EXPECT_TRUE(bound.apply(k == 0 ? 20 : 0, 50, u));
    EXPECT_LE(std::max(std::abs(u.ux), std::abs(u.uy)), 10 * 1.15 * 1.05);
    EXPECT_GE(std::max(std::abs(u.ux), std::abs(u.uy)), 5);
  }
  u = {50, 50};
  EXPECT_FALSE(bound.apply(0, 50, u)) << "as many cycles as were left out";
  EXPECT_EQ(u.ux, 50);
}

}  // namespace
}  // namespace whirl::rt
