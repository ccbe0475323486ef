#include "whirl/rt/release.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/testing/alloc_guard.hpp"

namespace whirl::rt {
namespace {

constexpr double kReleaseStep = 1e-3;

struct TurningRig {
  double omega = 75, omega_dot = 0, beta = 0;
  double x = 0;
  bool valid = true, angle_stands = false;
  double shown = 0;
  Fault reason = Fault::none;
  bool armed = false;
  Command written{};
  Measurement read() noexcept {
    if (!angle_stands) shown = beta;
    return {0, x, 0, shown, omega, omega_dot, valid};
  }
  void write(const Command& u) noexcept { written = u; }
  void advance() noexcept {
    beta += (omega + 0.5 * omega_dot * kReleaseStep) * kReleaseStep;
    omega += omega_dot * kReleaseStep;
  }
  void arm(bool on) noexcept { armed = on; }
  Fault fault() const noexcept { return reason; }
};

/// Holds against an unbalance, with a disturbance of another frequency.
struct HoldingLaw {
  long k = 0;
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    const double other = 0.5 * std::sin(0.9 * static_cast<double>(k++));
    return Command{3 * std::cos(m.beta) + 4 * std::sin(m.beta) + other, 2 * std::cos(m.beta - 1)};
  }
  void applied(const Command&) noexcept {}
};

struct ReleaseRealtime : ::testing::Test {
  TurningRig rig;
  HoldingLaw law;
  SimulatedClock clock{kReleaseStep};
  LoopOptions options{.sample_time = kReleaseStep, .release = 1000};
  SafetyLimits limits{.displacement = 1e-3, .stale = 5};
};

TEST_F(ReleaseRealtime, TheTurningPartFadesByTheAngleAlone) {
  rig.omega_dot = -10;
  Loop loop(rig, law, clock, limits, options);
  const testing::AllocationGuard guard;
  for (int k = 0; k < 500; ++k) loop.cycle();
  rig.valid = false;  // five ticks are bridged
  CycleRecord r;
  while (r.trip == Fault::none) r = loop.cycle();
  EXPECT_EQ(r.trip, Fault::stale_sensor);
  const double omega0 = 75 - 10 * 0.5;
  for (int k = 1; k < 1000; ++k) {
    ASSERT_TRUE(r.releasing) << k;
    ASSERT_TRUE(rig.armed);
    // What the fit leaves of the other frequency is small.
    const double g = (1 - 1e-3 * k) * std::min(1.0, std::pow((rig.omega + 10 * kReleaseStep) / omega0, 2));
    const double beta = rig.shown;
    ASSERT_NEAR(rig.written.ux, g * (3 * std::cos(beta) + 4 * std::sin(beta)), 0.15) << k;
    ASSERT_NEAR(rig.written.uy, g * 2 * std::cos(beta - 1), 0.01) << k;
    r = loop.cycle();
  }
  EXPECT_FALSE(r.releasing);
  EXPECT_FALSE(rig.armed);
  EXPECT_EQ(rig.written.ux, 0);
  EXPECT_EQ(guard.count(), 0u);
}

TEST_F(ReleaseRealtime, AStandingAngleGoesOnWithTheLastSpeed) {
  rig.omega_dot = -20;
  Loop loop(rig, law, clock, limits, options);
  for (int k = 0; k < 500; ++k) loop.cycle();
  rig.angle_stands = true;
  loop.stop(Fault::stale_sensor);
  const double omega0 = rig.omega;
  for (int k = 1; k < 1000; ++k) {
    const double beta = rig.beta, omega = rig.omega;
    loop.cycle();
    const double g = (1 - 1e-3 * k) * std::pow(omega / omega0, 2);
    ASSERT_NEAR(rig.written.uy, g * 2 * std::cos(beta - 1), 0.02) << k;
  }
}

TEST_F(ReleaseRealtime, AtRestTheForceItselfFades) {
  rig.omega = 0;
  rig.beta = 0.3;
  Loop loop(rig, law, clock, limits, options);
  for (int k = 0; k < 300; ++k) loop.cycle();
  const double held = 2 * std::cos(rig.beta - 1);
  loop.stop();
  loop.cycle();
  EXPECT_NEAR(rig.written.uy, held, 0.01 * held);
  for (int k = 0; k < 499; ++k) loop.cycle();
  EXPECT_NEAR(rig.written.uy, 0.5 * held, 0.01 * held);
}

TEST_F(ReleaseRealtime, ZeroAtOnceWhenTheForceMayBeTheFault) {
  for (const Fault fault : {Fault::displacement_limit, Fault::not_finite}) {
    Loop loop(rig, law, clock, limits, options);
    for (int k = 0; k < 300; ++k) loop.cycle();
    loop.stop(fault);
    const CycleRecord r = loop.cycle();
    EXPECT_FALSE(r.releasing);
    EXPECT_FALSE(rig.armed);
    EXPECT_EQ(rig.written.ux, 0);
  }
}

TEST_F(ReleaseRealtime, AnotherFaultOrALargeMotionEndsTheFading) {
  for (const bool motion : {true, false}) {
    rig.reason = Fault::none;
    rig.x = 0;
    Loop loop(rig, law, clock, limits, options);
    for (int k = 0; k < 300; ++k) loop.cycle();
    loop.stop();
    for (int k = 0; k < 10; ++k) EXPECT_TRUE(loop.cycle().releasing);
    if (motion) {
      rig.x = 2e-3;
    } else {
      rig.reason = Fault::watchdog;
    }
    const CycleRecord r = loop.cycle();
    EXPECT_FALSE(r.releasing);
    EXPECT_FALSE(rig.armed);
    EXPECT_EQ(rig.written.ux, 0);
    EXPECT_EQ(r.trip, Fault::requested) << "the first reason stays";
  }
}

/// A clock whose samples stay away, or that brings a person's trip.
struct FaultyClock {
  Fault reason = Fault::none;
  long wait() const noexcept { return 0; }
  Fault fault() const noexcept { return reason; }
};

TEST_F(ReleaseRealtime, WithoutATimeBaseOrOnAPersonsTripThereIsNoFading) {
  for (const Fault fault : {Fault::watchdog, Fault::requested}) {
    for (const bool already : {false, true}) {
      FaultyClock faulty;
      Loop loop(rig, law, faulty, limits, options);
      for (int k = 0; k < 300; ++k) loop.cycle();
      if (already) loop.stop(Fault::stale_sensor);
      EXPECT_EQ(loop.cycle().releasing, already);
      faulty.reason = fault;
      EXPECT_FALSE(loop.cycle().releasing);
      EXPECT_FALSE(rig.armed);
      EXPECT_EQ(rig.written.ux, 0);
    }
  }
}

TEST_F(ReleaseRealtime, ClearEndsTheFadingAndArmNeedsIt) {
  Loop loop(rig, law, clock, limits, options);
  for (int k = 0; k < 300; ++k) loop.cycle();
  loop.stop();
  loop.cycle();
  EXPECT_TRUE(loop.releasing());
  EXPECT_FALSE(loop.arm());
  loop.clear();
  EXPECT_FALSE(rig.armed);
  EXPECT_FALSE(loop.cycle().releasing);
  EXPECT_EQ(rig.written.ux, 0);
  EXPECT_TRUE(loop.arm());
  loop.cycle();
  EXPECT_NE(rig.written.ux, 0);
}

/// Turns with the rotor; `amplitude` as told.
struct ForwardLaw {
  double amplitude = 10;
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    return Command{amplitude * std::cos(m.beta), amplitude * std::sin(m.beta)};
  }
  void applied(const Command&) noexcept {}
};

/// Without its sensor until the force is zero: the largest force of an axis meanwhile.
template <class AnyLoop>
double largest_without_sensor(AnyLoop& loop, TurningRig& rig) {
  rig.valid = false;
  for (int k = 0; k < 100 && loop.armed(); ++k) loop.cycle();
  EXPECT_EQ(loop.safety().trip, Fault::stale_sensor);
  double largest = 0;
  for (int k = 0; k < 2000 && loop.releasing(); ++k) {
    loop.cycle();
    largest = std::max({largest, std::abs(rig.written.ux), std::abs(rig.written.uy)});
  }
  EXPECT_FALSE(loop.releasing());
  return largest;
}

TEST_F(ReleaseRealtime, WhatFadesWasLearnedSinceArming) {
  ForwardLaw turning;
  Loop loop(rig, turning, clock, limits, options);
  for (int k = 0; k < 500; ++k) loop.cycle();
  loop.disarm();
  for (int k = 0; k < 1000; ++k) loop.cycle();
  turning.amplitude = 0.1;
  ASSERT_TRUE(loop.arm());
  for (int k = 0; k < 5; ++k) loop.cycle();
  EXPECT_LE(largest_without_sensor(loop, rig), 0.1) << "the force of the time before fades";
  rig.valid = true;
  loop.clear();
  ASSERT_TRUE(loop.arm());
  loop.stop();
  loop.cycle();
  EXPECT_EQ(rig.written.ux, 0) << "nothing was learned";
}

// Two samples hardly show the direction in which a rotor turned by four degrees.
TEST_F(ReleaseRealtime, FewSamplesNeverFadeLargerThanTheForceThatWasSent) {
  ForwardLaw turning;
  turning.amplitude = 0;
  Loop loop(rig, turning, clock, limits, options);
  loop.cycle();
  turning.amplitude = 1;
  loop.cycle();
  EXPECT_LE(largest_without_sensor(loop, rig), 4 / std::numbers::pi) << "of a square wave of 1 N";
}

}  // namespace
}  // namespace whirl::rt
