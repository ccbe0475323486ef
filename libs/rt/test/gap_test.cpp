// Ticks that were left out, in numbers worked out apart from the loop.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "whirl/rt/loop.hpp"

namespace whirl::rt {
namespace {

constexpr double kH = 1e-3;

Command bounded(GapBound& bound, long missed, double limit, Command u, bool expected) {
  EXPECT_EQ(bound.apply(missed, limit, u), expected);
  return u;
}

TEST(GapBoundReference, RemembersTheLargestForceOfAFifthOfASecond) {
  const double remembered = 1.15 * 8 / std::numbers::e;
  for (const Command force : {Command{-8, 3}, Command{3, 8}, Command{8, -3}, Command{-3, -8}}) {
    for (const long missed : {1L, 5L, 7L}) {
      GapBound bound(kH);
      (void)bounded(bound, 0, 0, force, false);
      for (int k = 0; k < 200; ++k) (void)bounded(bound, 0, 0, {}, false);
      // While it bounds, the bound grows by e in half a second.
      const long cycles = std::max(5L, missed);
      for (long k = 0; k < cycles; ++k) {
        const Command u = bounded(bound, k == 0 ? missed : 0, 0, {100, -100}, true);
        const double most = remembered * std::exp(kH * static_cast<double>(k) / 0.5);
        EXPECT_NEAR(u.ux, most, 1e-12);
        EXPECT_NEAR(u.uy, -most, 1e-12);
      }
      EXPECT_EQ(bounded(bound, 0, 0, {100, -100}, false).ux, 100);
    }
  }
}

TEST(GapBoundReference, EachAxisAloneATenthOfTheLimitIsFreeAndAnotherGapBeginsAnew) {
  GapBound bound(kH);
  EXPECT_EQ(bounded(bound, 3, 0, {100, 100}, false).ux, 100) << "nothing to bound by";
  bound = GapBound(kH);
  Command u = bounded(bound, 1, 40, {100, 1}, true);
  EXPECT_EQ(u.ux, 4);
  EXPECT_EQ(u.uy, 1);
  u = bounded(bound, 0, 40, {-1, -100}, true);
  EXPECT_EQ(u.ux, -1);
  EXPECT_EQ(u.uy, -4);
  u = bounded(bound, 0, 40, {3, -4}, false);
  EXPECT_EQ(u.ux, 3);
  EXPECT_EQ(u.uy, -4);
  (void)bounded(bound, 2, 40, {100, 0}, true);
  for (int k = 0; k < 4; ++k) (void)bounded(bound, 0, 40, {0, 100}, true);
  (void)bounded(bound, 0, 40, {100, 100}, false);
  // A long gap is not shortened by a short one within it.
  (void)bounded(bound, 9, 400, {1000, 0}, true);
  (void)bounded(bound, 1, 400, {1000, 0}, true);
  for (int k = 0; k < 7; ++k) (void)bounded(bound, 0, 400, {1000, 0}, true);
  (void)bounded(bound, 0, 400, {1000, 0}, false);
}

/// A rotor whose sensor point turns with it at a radius that grows, the angle within one turn when `wrapped`.
Measurement turning(double t, bool wrapped = false) {
  Measurement m;
  m.t = t;
  m.beta = 1 + 80 * t - 45 * t * t;
  m.omega = 80 - 90 * t;
  m.omega_dot = -90;
  const double r = 3e-4 * (1 + 4 * t);
  m.x = r * std::cos(m.beta + 0.4);
  m.y = r * std::sin(m.beta + 0.4);
  if (wrapped) m.beta = std::remainder(m.beta, 2 * std::numbers::pi);
  return m;
}

TEST(GapReference, ABridgeBetweenWrappedAnglesIsTheSameMotion) {
  for (const double gap : {4e-3, 0.03, 0.12}) {
    for (const double part : {0.25, 0.5, 0.875}) {
      const Measurement from = turning(0.2, true), m = bridge(from, turning(0.2 + gap, true), part),
                        truth = turning(0.2 + part * gap);
      EXPECT_NEAR(std::remainder(m.beta - truth.beta, 2 * std::numbers::pi), 0, 1e-11);
      EXPECT_NEAR(m.t, truth.t, 1e-15);
      EXPECT_NEAR(m.omega, truth.omega, 1e-11);
      EXPECT_NEAR(m.omega_dot, -90, 1e-11);
      EXPECT_NEAR(m.x, truth.x, 1e-14);
      EXPECT_NEAR(m.y, truth.y, 1e-14);
    }
  }
}

// The angle may have moved otherwise than the speed says: the ends of the bridge are the samples.
TEST(GapReference, ABridgeEndsAtItsSamplesWhateverTheSpeedSays) {
  Measurement from = turning(0.2), to = turning(0.21);
  to.beta += 0.3;
  EXPECT_NEAR(bridge(from, to, 0).beta, from.beta, 1e-12);
  EXPECT_NEAR(bridge(from, to, 1).beta, to.beta, 1e-12);
  EXPECT_NEAR(bridge(from, to, 0).x, from.x, 1e-15);
  EXPECT_NEAR(bridge(from, to, 1).x, to.x, 1e-15);
  EXPECT_NEAR(bridge(from, to, 1).y, to.y, 1e-15);
}

/// Hands over what the test says; may have a fault.
struct ScriptRig {
  Measurement next;
  Command written;
  Fault reason = Fault::none;
  bool armed = false;
  void arm(bool a) noexcept { armed = a; }
  Measurement read() const noexcept { return next; }
  void write(const Command& c) noexcept { written = c; }
  void advance() const noexcept {}
  Fault fault() const noexcept { return reason; }
};
struct ScriptClock {
  long gap = 0;
  Fault reason = Fault::none;
  long wait() noexcept { return std::exchange(gap, 0); }
  Fault fault() const noexcept { return reason; }
};
/// Remembers every sample and correction.
struct RememberingLaw {
  std::array<Measurement, 64> seen{};
  std::array<Command, 64> corrected{};
  std::size_t steps = 0, corrections = 0;
  Command want{2, -1};
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    seen[steps++ % seen.size()] = m;
    return want;
  }
  void applied(const Command& c) noexcept { corrected[corrections++ % corrected.size()] = c; }
};

TEST(GapReference, FilledTicksLieOnTheMotionAndTheForceIsTheOneThatWasSent) {
  for (const long gap : {1L, 4L, 12L}) {
    ScriptRig rig;
    RememberingLaw law;
    ScriptClock clock;
    Loop loop(rig, law, clock, {}, {.dt = DtPolicy::fill, .max_fill = 8, .sample_time = kH});
    rig.next = turning(0.2);
    loop.cycle();
    clock.gap = gap;
    const double now = 0.2 + kH * static_cast<double>(gap + 1);
    rig.next = turning(now);
    loop.cycle();
    const long filled = std::min(gap, 8L);
    ASSERT_EQ(law.steps, static_cast<std::size_t>(2 + filled));
    ASSERT_EQ(law.corrections, static_cast<std::size_t>(filled));
    for (long i = 1; i <= filled; ++i) {
      const Measurement m = law.seen[static_cast<std::size_t>(i)],
                        truth = turning(now - kH * static_cast<double>(filled + 1 - i));
      EXPECT_TRUE(m.valid);
      EXPECT_NEAR(m.t, truth.t, 1e-12);
      EXPECT_NEAR(m.beta, truth.beta, 1e-9);
      EXPECT_NEAR(m.omega, truth.omega, 1e-9);
      EXPECT_NEAR(m.x, truth.x, 1e-12);
      EXPECT_NEAR(m.y, truth.y, 1e-12);
      EXPECT_EQ(law.corrected[static_cast<std::size_t>(i - 1)].ux, 2);
      EXPECT_EQ(law.corrected[static_cast<std::size_t>(i - 1)].uy, -1);
    }
    EXPECT_EQ(law.seen[static_cast<std::size_t>(filled + 1)].t, now);
  }
}

// One end of the gap is no sample: the angle goes on at its speed, the samples are lost.
TEST(GapReference, WithoutBothEndsTheFilledSamplesAreLostAndTheAngleGoesOn) {
  for (const bool first_is_lost : {true, false}) {
    ScriptRig rig;
    RememberingLaw law;
    ScriptClock clock;
    Loop loop(rig, law, clock, {}, {.dt = DtPolicy::fill, .sample_time = kH});
    rig.next = turning(0.2);
    rig.next.valid = !first_is_lost;
    loop.cycle();
    clock.gap = 3;
    rig.next = turning(0.204);
    rig.next.valid = first_is_lost;
    loop.cycle();
    ASSERT_EQ(law.steps, 5u);
    for (std::size_t i = 1; i <= 3; ++i) {
      const Measurement m = law.seen[i], truth = turning(0.2 + kH * static_cast<double>(i));
      EXPECT_FALSE(m.valid);
      EXPECT_NEAR(m.t, truth.t, 1e-12);
      EXPECT_NEAR(m.beta, truth.beta, 1e-12);
      EXPECT_NEAR(m.omega, truth.omega, 1e-12);
    }
  }
}

// What was sent is what is recorded, what the law is told and what the rate of change counts from.
TEST(GapReference, TheFirstForcesAfterAGapAreBoundedInTheLoop) {
  EXPECT_FALSE(CycleRecord{}.armed);
  EXPECT_FALSE(CycleRecord{}.limited);
  EXPECT_FALSE(CycleRecord{}.releasing);
  ScriptRig rig;
  RememberingLaw law;
  ScriptClock clock;
  {
    Loop loop(rig, law, clock, {.force = 50, .slew = 48.5}, {.sample_time = kH});
    rig.next = turning(0.2);
    for (int k = 0; k < 10; ++k) EXPECT_FALSE(loop.cycle().limited);
    EXPECT_TRUE(rig.armed);
    EXPECT_EQ(law.corrections, 0u);
    law.want = {50, -40};
    clock.gap = 2;
    CycleRecord r = loop.cycle();
    EXPECT_TRUE(r.limited);
    EXPECT_EQ(r.sent.ux, 5);
    EXPECT_EQ(r.sent.uy, -5);
    EXPECT_EQ(rig.written.ux, 5);
    EXPECT_EQ(law.corrections, 1u);
    EXPECT_EQ(law.corrected[0].uy, -5);
    for (int k = 0; k < 4; ++k) r = loop.cycle();
    EXPECT_EQ(r.sent.ux, 5);
    r = loop.cycle();
    EXPECT_EQ(r.sent.ux, 50) << "45 N a tick from 5 N";
    EXPECT_FALSE(r.limited);
  }
  EXPECT_FALSE(rig.armed) << "the loop is gone";
  EXPECT_EQ(rig.written.ux, 0);
}

TEST(GapReference, TicksLeftOutAreCountedAndWithoutALimitNoGapIsTooLong) {
  ScriptRig rig;
  RememberingLaw law;
  ScriptClock clock;
  Loop loop(rig, law, clock, {}, {.max_gap = 0, .sample_time = kH});
  rig.next = turning(0.2);
  EXPECT_EQ(loop.cycle().tick, 0);
  clock.gap = 5000;
  const CycleRecord r = loop.cycle();
  EXPECT_EQ(r.tick, 5001);
  EXPECT_EQ(r.trip, Fault::none);
  loop.disarm();
  EXPECT_TRUE(static_cast<bool>(loop.cycle().request)) << "disarmed is no fault";
  EXPECT_TRUE(loop.arm());
  loop.stop();
  loop.cycle();
  EXPECT_FALSE(static_cast<bool>(loop.cycle().request)) << "tripped is";
}

// What was seen before the force was taken away is no end of a gap after it came back.
TEST(GapReference, AGapAtTheFirstCycleAfterArmingHasNoBeginning) {
  ScriptRig rig;
  RememberingLaw law;
  ScriptClock clock;
  Loop loop(rig, law, clock, {}, {.dt = DtPolicy::fill, .sample_time = kH});
  EXPECT_FALSE(loop.releasing());
  rig.next = turning(0.1);
  loop.cycle();
  loop.disarm();
  loop.cycle();
  EXPECT_TRUE(loop.arm());
  clock.gap = 3;
  rig.next = turning(0.2);
  loop.cycle();
  ASSERT_EQ(law.steps, 5u);
  for (std::size_t i = 1; i <= 3; ++i) EXPECT_FALSE(law.seen[i].valid);
}

// A fading force goes on by the angle alone: four ticks at once turn and fade it as four one by one.
TEST(GapReference, AGapWhileTheForceFadesIsAsLongAsItsTicks) {
  const auto faded = [](bool at_once) {
    ScriptRig rig;
    RememberingLaw law;
    ScriptClock clock;
    Loop loop(rig, law, clock, {}, {.sample_time = kH, .release = 200});
    for (int k = 0; k < 100; ++k) {
      rig.next = turning(kH * k);
      law.want = {5 * std::cos(rig.next.beta), 5 * std::sin(rig.next.beta)};
      loop.cycle();
    }
    rig.reason = kEncoderStuck;  // the angle stands from now on
    loop.cycle();
    clock.gap = at_once ? 3 : 0;
    for (int k = 0; k < (at_once ? 1 : 4); ++k) loop.cycle();
    return rig.written;
  };
  const Command together = faded(true), apart = faded(false);
  EXPECT_GT(std::hypot(apart.ux, apart.uy), 3);
  EXPECT_NEAR(together.ux, apart.ux, 1e-2);
  EXPECT_NEAR(together.uy, apart.uy, 1e-2);
}

// The reason that is told, and whether the force may fade: what is gone brings no samples, and that is no other reason.
TEST(LoopFaultRealtime, ALostBoardIsTheReasonAndTheForceIsZeroAtOnce) {
  struct Case {
    Fault rig, clock, told;
    bool fades;
  };
  for (const Case& c :
       {Case{kBoardLost, Fault::watchdog, kBoardLost, false}, Case{kBoardLost, Fault::none, kBoardLost, false},
        Case{kEncoderStuck, Fault::overrun, Fault::overrun, true},
        Case{kEncoderStuck, Fault::none, kEncoderStuck, true}, Case{Fault::none, Fault::overrun, Fault::overrun, true},
        Case{Fault::none, Fault::watchdog, Fault::watchdog, false},
        Case{Fault::watchdog, Fault::none, Fault::watchdog, true}}) {
    SCOPED_TRACE(std::string(to_string(c.rig)) + " " + std::string(to_string(c.clock)));
    ScriptRig rig;
    RememberingLaw law;
    ScriptClock clock;
    Loop loop(rig, law, clock, {}, {.sample_time = kH, .release = 100});
    for (int k = 0; k < 40; ++k) {
      rig.next = turning(kH * k);
      loop.cycle();
    }
    EXPECT_EQ(rig.written.ux, 2);
    rig.reason = c.rig;
    clock.reason = c.clock;
    const CycleRecord r = loop.cycle();
    EXPECT_EQ(r.trip, c.told);
    EXPECT_EQ(r.releasing, c.fades);
    EXPECT_EQ(rig.written.ux != 0 || rig.written.uy != 0, c.fades);
  }
}

/// What it is told before each read.
struct ToldRig : ScriptRig {
  long told = 0, at_read = -1;
  void left_out(long ticks) noexcept { told = ticks; }
  Measurement read() noexcept { return at_read = std::exchange(told, -1), next; }
};

TEST(GapReference, TheRigIsToldBeforeItIsReadHowManyTicksWereLeftOut) {
  ToldRig rig;
  RememberingLaw law;
  ScriptClock clock;
  Loop loop(rig, law, clock);
  for (const long gap : {0L, 3L, 0L, 80L}) {
    clock.gap = gap;
    loop.cycle();
    EXPECT_EQ(rig.at_read, gap);
  }
}

}  // namespace
}  // namespace whirl::rt
