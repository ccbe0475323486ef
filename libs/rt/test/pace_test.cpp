#include "whirl/rt/pace.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/record_queue.hpp"
#include "whirl/testing/alloc_guard.hpp"

namespace whirl::rt {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// Time that passes only when told: work takes as long as the script says, sleeping ends late by as much.
struct ScriptedTime {
  std::int64_t t = 0;
  std::int64_t wake_late = 0;
  std::int64_t now() const noexcept { return t; }
  void sleep_until(std::int64_t at) noexcept {
    t = std::max(t, at) + wake_late;
    wake_late = 0;
  }
};

PaceOptions options(OverrunPolicy policy) {
  PaceOptions o;
  o.overrun = policy;
  o.max_catch_up = 2;
  o.trip_after = 3;
  return o;
}

TEST(PaceRealtime, InTimeTheGridNeverMoves) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::skip));
  for (int k = 1; k <= 1000; ++k) {
    EXPECT_EQ(clock.wait(), 0);
    EXPECT_EQ(clock.scheduled(), k * kMs);
    time.t += 700'000 + 100 * k;  // work
  }
  EXPECT_EQ(clock.timing().executed, 1000);
  EXPECT_EQ(clock.timing().late_work, 0);
  EXPECT_EQ(clock.timing().missed, 0);
}

TEST(PaceRealtime, SkipLeavesOutWhatIsPastAndKeepsThePhase) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::skip));
  clock.wait();         // at 1 ms
  time.t += 3'200'000;  // until 4.2 ms: the instants 2, 3 and 4 are gone
  EXPECT_EQ(clock.wait(), 3);
  EXPECT_EQ(time.t, 5 * kMs);
  EXPECT_EQ(clock.scheduled(), 5 * kMs);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(time.t, 6 * kMs);
  EXPECT_EQ(clock.timing().executed + clock.timing().missed, 6);
  EXPECT_EQ(clock.timing().late_work, 1);
}

TEST(PaceRealtime, ALateWakeUpIsCountedApartAndKeepsThePhaseToo) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::skip));
  clock.wait();
  time.wake_late = 2'500'000;
  EXPECT_EQ(clock.wait(), 2);  // due at 2, woken at 4.5 ms: this is the cycle of 4 ms
  EXPECT_EQ(clock.scheduled(), 4 * kMs);
  EXPECT_EQ(clock.timing().late_wake, 1);
  EXPECT_EQ(clock.timing().late_work, 0);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(time.t, 5 * kMs);
}

TEST(PaceRealtime, CatchUpRunsBackToBackButNotForEver) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::catch_up));
  clock.wait();
  time.t = 3'300'000;  // 2 and 3 are due
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.scheduled(), 2 * kMs);
  EXPECT_EQ(time.t, 3'300'000) << "no sleep while behind";
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.scheduled(), 3 * kMs);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(time.t, 4 * kMs) << "caught up";
  time.t = 20'500'000;  // 5 to 20 are due; 18, 19, 20 are made up for
  EXPECT_EQ(clock.wait(), 13);
  EXPECT_EQ(clock.scheduled(), 18 * kMs);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.scheduled(), 20 * kMs);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(time.t, 21 * kMs);
  EXPECT_EQ(clock.timing().executed + clock.timing().missed, 21);
}

TEST(PaceRealtime, TripNeedsOverrunsInARow) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::trip));
  const auto late = [&] {
    time.t += 1'100'000;
    clock.wait();
    return clock.fault();
  };
  clock.wait();
  EXPECT_EQ(late(), Fault::none);
  EXPECT_EQ(late(), Fault::none);
  clock.wait();  // one in time: the count starts anew
  EXPECT_EQ(late(), Fault::none);
  EXPECT_EQ(late(), Fault::none);
  EXPECT_EQ(late(), Fault::overrun);
}

TEST(PaceProperty, ScheduledIsExecutedPlusMissedUnderAnyWork) {
  std::uint64_t state = 1;
  const auto random = [&] { return state = state * 6364136223846793005u + 1442695040888963407u, state >> 33; };
  for (const OverrunPolicy policy : {OverrunPolicy::skip, OverrunPolicy::catch_up, OverrunPolicy::trip}) {
    ScriptedTime time;
    PacedClock clock(time, options(policy));
    long tick = 0;
    for (int k = 0; k < 20000; ++k) {
      tick += 1 + clock.wait();
      ASSERT_EQ(clock.scheduled(), tick * kMs);
      ASSERT_GE(time.t, clock.scheduled());
      time.t += static_cast<std::int64_t>(random() % (k % 100 == 0 ? 9'000'000 : 1'200'000));
      if (random() % 50 == 0) time.wake_late = static_cast<std::int64_t>(random() % 3'000'000);
    }
    EXPECT_EQ(clock.timing().executed, 20000);
    EXPECT_EQ(clock.timing().executed + clock.timing().missed, tick);
    EXPECT_EQ(clock.timing().latency.total(), 20000u);
  }
}

/// Rig whose samples arrive as the script says: ticks advanced per wait.
struct ScriptedSamples {
  std::vector<long> arrive;
  std::size_t at = 0;
  long wait(std::int64_t) noexcept { return arrive[at++]; }
};

TEST(PaceRealtime, SamplesDriveTheLoopAndTheirSilenceTrips) {
  ScriptedTime time;
  ScriptedSamples samples{{1, 1, 3, 0, 1}};
  SampleClock clock(samples, time, options(OverrunPolicy::skip), 50 * kMs);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.wait(), 2);
  EXPECT_EQ(clock.fault(), Fault::none);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.fault(), Fault::watchdog);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.fault(), Fault::none) << "whether a fault latches is the loop's business";
  EXPECT_EQ(clock.timing().missed, 2);
}

TEST(PaceRealtime, TheInstantItselfIsInTimeAndOneNanosecondLaterIsNot) {
  const PaceState state{.next = 5 * kMs, .in_a_row = 4};
  for (const OverrunPolicy policy : {OverrunPolicy::skip, OverrunPolicy::catch_up, OverrunPolicy::trip}) {
    const PaceStep step = pace(options(policy), state, 5 * kMs);
    EXPECT_TRUE(step.sleep);
    EXPECT_EQ(step.missed, 0);
    EXPECT_EQ(step.fault, Fault::none);
    EXPECT_EQ(step.state.in_a_row, 0);
    EXPECT_EQ(step.at, 5 * kMs);
    EXPECT_EQ(step.state.next, 6 * kMs);
    EXPECT_EQ(pace(options(policy), state, 5 * kMs + 1).state.in_a_row, 5);
    EXPECT_EQ(pace(options(policy), state, 5 * kMs + 1).sleep, policy != OverrunPolicy::catch_up);
  }
  const auto skip = [&](std::int64_t now) { return pace(options(OverrunPolicy::skip), state, now); };
  EXPECT_EQ(skip(5 * kMs + 1).missed, 1) << "its instant is past";
  EXPECT_EQ(skip(6 * kMs).missed, 1) << "the next instant is now";
  EXPECT_EQ(skip(6 * kMs).at, 6 * kMs);
  EXPECT_EQ(skip(6 * kMs + 1).missed, 2);
}

TEST(PaceRealtime, OnlyThePolicyThatTripsTripsHoweverManyOverrunsThereWere) {
  for (const OverrunPolicy policy : {OverrunPolicy::skip, OverrunPolicy::catch_up, OverrunPolicy::trip}) {
    EXPECT_EQ(pace(options(policy), {.next = 0, .in_a_row = 100}, 1).fault,
              policy == OverrunPolicy::trip ? Fault::overrun : Fault::none);
    ScriptedTime time{.t = 7 * kMs};
    ScriptedSamples samples{{1, 2, 3, 2, 1, 3, 2, 4}};
    SampleClock clock(samples, time, options(policy), 50 * kMs);
    for (const Fault expected : {Fault::none, Fault::none, Fault::none, Fault::overrun, Fault::none, Fault::none,
                                 Fault::none, Fault::overrun}) {
      clock.wait();
      EXPECT_EQ(clock.fault(), policy == OverrunPolicy::trip ? expected : Fault::none);
    }
  }
}

TEST(PaceRealtime, AWakeUpThatIsTooLateIsMadeUpForWhereThatIsThePolicy) {
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::catch_up));
  clock.wait();
  time.wake_late = 1'500'000;
  EXPECT_EQ(clock.wait(), 0);  // due at 2, woken at 3.5 ms
  EXPECT_EQ(clock.scheduled(), 2 * kMs);
  EXPECT_EQ(clock.timing().late_wake, 1);
  EXPECT_EQ(clock.wait(), 0);
  EXPECT_EQ(clock.scheduled(), 3 * kMs);
  EXPECT_EQ(time.t, 3'500'000);
}

TEST(PaceRealtime, WhatIsStatedAboutTheTimingIsWhatHappened) {
  ScriptedTime time{.t = 10 * kMs};
  PacedClock clock(time, options(OverrunPolicy::skip));
  clock.wait();  // tick 0, at 11 ms
  EXPECT_EQ(clock.timing().execution.total(), 0u) << "nothing was done before the first cycle";
  EXPECT_EQ(clock.timing().period.total(), 0u);
  time.t += 300'000;
  clock.wait();  // tick 1
  EXPECT_DOUBLE_EQ(clock.timing().execution.max(), 300e-6);
  EXPECT_DOUBLE_EQ(clock.timing().period.max(), 1e-3);
  time.t += kMs;  // at the instant itself
  clock.wait();   // tick 2
  EXPECT_EQ(clock.timing().late_work, 0);
  time.t += 2'500'000;
  clock.wait();  // tick 5
  EXPECT_EQ(clock.timing().late_work, 1);
  EXPECT_DOUBLE_EQ(clock.timing().execution.max(), 2500e-6);
  EXPECT_EQ(clock.timing().execution.worst(), 2) << "the cycle that took so long";
  EXPECT_DOUBLE_EQ(clock.timing().period.max(), 3e-3);
  EXPECT_EQ(clock.timing().period.worst(), 5);
  time.wake_late = 200'000;
  clock.wait();  // tick 6
  EXPECT_DOUBLE_EQ(clock.timing().latency.max(), 200e-6);
  EXPECT_EQ(clock.timing().latency.worst(), 6);
  EXPECT_EQ(clock.timing().executed, 5);
  EXPECT_EQ(clock.timing().execution.total(), 4u);
}

/// Samples that come after so long a time, ns.
struct TimedSamples {
  ScriptedTime& time;
  long advanced = 1;
  std::int64_t after = 0;
  long wait(std::int64_t) noexcept { return time.t += after, advanced; }
};

TEST(PaceRealtime, TicksLeftOutByTheCycleItselfAndByTheSamplesAreCountedApart) {
  ScriptedTime time{.t = 5 * kMs};
  TimedSamples samples{time};
  SampleClock clock(samples, time, options(OverrunPolicy::skip), 50 * kMs);
  const auto wait = [&](std::int64_t work, long advanced, std::int64_t after) {
    time.t += work;
    samples.advanced = advanced, samples.after = after;
    return clock.wait();
  };
  EXPECT_EQ(wait(0, 4, kMs), 3);
  EXPECT_EQ(clock.timing().late_source, 1) << "no cycle was before";
  EXPECT_EQ(clock.timing().execution.total(), 0u);
  EXPECT_EQ(clock.timing().period.total(), 0u);
  EXPECT_EQ(wait(200'000, 1, 800'000), 0);  // tick 4
  EXPECT_EQ(wait(kMs, 3, kMs), 2);          // tick 7: done in time, the samples of two ticks never came
  EXPECT_EQ(clock.timing().late_source, 2);
  EXPECT_EQ(clock.timing().late_work, 0);
  EXPECT_EQ(wait(kMs + 1, 2, 999'999), 1);  // tick 9
  EXPECT_EQ(clock.timing().late_work, 1);
  EXPECT_EQ(clock.timing().late_source, 2);
  EXPECT_EQ(clock.timing().executed, 4);
  EXPECT_EQ(clock.timing().missed, 6);
  EXPECT_DOUBLE_EQ(clock.timing().execution.max(), 1.000001e-3);
  EXPECT_EQ(clock.timing().execution.worst(), 7);
  EXPECT_DOUBLE_EQ(clock.timing().period.max(), 2e-3);
  EXPECT_EQ(clock.timing().period.worst(), 7);
  EXPECT_EQ(clock.scheduled(), time.t);
  EXPECT_EQ(clock.started(), time.t);
}

struct Rig {
  Command written{9, 9};
  bool armed = false;
  Fault reason = Fault::none;
  bool lost = false;
  Measurement read() const noexcept { return {.valid = !lost}; }
  void write(const Command& c) noexcept { written = c; }
  void advance() const noexcept {}
  void arm(bool on) noexcept { armed = on; }
  Fault fault() const noexcept { return reason; }
};

struct Law {
  long steps = 0, lost = 0;
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    ++steps;
    lost += !m.valid;
    return Command{1, 2};
  }
  void applied(const Command&) noexcept {}
};

TEST(ArmingRealtime, EveryTransitionBetweenDisarmedArmedAndTripped) {
  Rig rig;
  Law law;
  ScriptedTime time;
  PacedClock clock(time, options(OverrunPolicy::trip));
  Loop loop(rig, law, clock, {}, {.armed = false});
  const testing::AllocationGuard guard;
  loop.cycle();
  EXPECT_EQ(law.steps, 0) << "disarmed: the law is not asked";
  EXPECT_EQ(rig.written.ux, 0);
  EXPECT_TRUE(loop.arm());
  EXPECT_TRUE(rig.armed);
  EXPECT_EQ(loop.cycle().trip, Fault::none);
  EXPECT_EQ(rig.written.uy, 2);
  loop.disarm();
  EXPECT_FALSE(rig.armed);
  EXPECT_EQ(loop.cycle().trip, Fault::none);
  EXPECT_EQ(rig.written.uy, 0) << "disarmed without a trip";
  EXPECT_TRUE(loop.arm());
  Fault trip = Fault::none;
  for (int k = 0; k < 3; ++k) {
    time.t += 1'500'000;
    trip = loop.cycle().trip;
  }
  EXPECT_EQ(trip, Fault::overrun);
  EXPECT_FALSE(loop.armed());
  EXPECT_FALSE(rig.armed);
  EXPECT_EQ(rig.written.ux, 0);
  EXPECT_FALSE(loop.arm());
  loop.clear();
  EXPECT_FALSE(loop.armed());
  EXPECT_TRUE(loop.arm());
  rig.reason = Fault::watchdog;
  EXPECT_EQ(loop.cycle().trip, Fault::watchdog);
  rig.reason = Fault::none;
  EXPECT_EQ(loop.cycle().trip, Fault::watchdog) << "latched";
  loop.clear();
  loop.arm();
  loop.stop();
  EXPECT_EQ(loop.cycle().trip, Fault::requested);
  EXPECT_EQ(guard.count(), 0u);
}

TEST(ArmingRealtime, MissedTicksAreFilledForALawThatCountsOnItsSampleTime) {
  for (const DtPolicy policy : {DtPolicy::nominal, DtPolicy::fill}) {
    Rig rig;
    Law law;
    ScriptedTime time;
    PacedClock clock(time, options(OverrunPolicy::skip));
    Loop loop(rig, law, clock, {}, {.armed = true, .dt = policy, .max_fill = 4});
    loop.cycle();
    time.t += 3'200'000;
    EXPECT_EQ(loop.cycle().missed, 3);
    EXPECT_EQ(law.steps, policy == DtPolicy::fill ? 5 : 2);
    EXPECT_EQ(law.lost, 0) << "both ends are there: the motion between them is filled in";
    time.t += 50'000'000;
    loop.cycle();
    EXPECT_EQ(law.steps, policy == DtPolicy::fill ? 10 : 3) << "bounded";
    rig.lost = true;
    time.t += 50'000'000;
    loop.cycle();
    EXPECT_EQ(law.lost, policy == DtPolicy::fill ? 5 : 1) << "without an end the samples are lost";
  }
}

TEST(Histogram, QuantilesBoundTheValuesFromAboveByAClass) {
  Histogram h;
  EXPECT_EQ(h.quantile(0.5), 0);
  for (int k = 1; k <= 1000; ++k) h.add(k * 1000, k);
  EXPECT_EQ(h.total(), 1000u);
  EXPECT_DOUBLE_EQ(h.max(), 1e-3);
  EXPECT_EQ(h.worst(), 1000);
  for (const double q : {0.1, 0.5, 0.9, 0.99}) {
    EXPECT_GE(h.quantile(q), q * 1e-3 * (1 - 1e-9));
    EXPECT_LE(h.quantile(q), q * 1e-3 * 1.126);
  }
  std::uint64_t sum = 0;
  for (int octave = 0; octave < 40; ++octave) sum += h.in_octave(octave);
  EXPECT_EQ(sum, 1000u);
}

TEST(RecordQueueRealtime, RefusesAndCountsInsteadOfWaiting) {
  RecordQueue<int> queue(5);
  EXPECT_EQ(queue.capacity(), 8u);
  const testing::AllocationGuard guard;
  for (int k = 0; k < 10; ++k) EXPECT_EQ(queue.push(k), k < 8);
  EXPECT_EQ(queue.dropped(), 2u);
  int v = -1;
  for (int k = 0; k < 8; ++k) {
    EXPECT_TRUE(queue.pop(v));
    EXPECT_EQ(v, k);
  }
  EXPECT_FALSE(queue.pop(v));
  EXPECT_TRUE(queue.push(77));
  EXPECT_TRUE(queue.pop(v));
  EXPECT_EQ(v, 77);
  EXPECT_EQ(guard.count(), 0u);
}

}  // namespace
}  // namespace whirl::rt
