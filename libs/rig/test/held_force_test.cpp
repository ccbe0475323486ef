// Actuators with slew, hysteresis and a current limit, and boards that turn a held force on, in numbers worked out
// here.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <utility>

#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::rig {
namespace {

RigParameters plain() {
  RigParameters p;
  p.actuator.gain_error = p.actuator.axis_rotation = 0;
  p.actuator.bandwidth = 0;
  p.actuator.bits = 0;
  p.actuator.delay_samples = 0;
  return p;
}

TEST(ActuatorSheetReference, SlewHysteresisAndCurrentLimitShapeTheForce) {
  RigParameters p = plain();
  p.actuator.slew = 2000;        // 2 N a tick
  p.actuator.hysteresis = 1;     // half a newton either way
  p.actuator.current_limit = 3;  // 9 N
  p.actuator.force_per_ampere = 3;
  EXPECT_EQ(p.actuator.force_limit(), 9);
  VirtualRig rig(p, {});
  const RigTruth truth(rig);
  double follows = 0, acts = 0;
  for (int k = 0; k < 60; ++k) {
    const double asked = k < 20 ? 30 : k < 40 ? 9 - 0.25 * (k - 20) : -30;
    rig.write({asked, 0});
    rig.advance();
    const double reachable = std::min(9.0, std::max(-9.0, asked));
    follows += std::min(2.0, std::max(-2.0, reachable - follows));
    acts = std::max(follows - 0.5, std::min(follows + 0.5, acts));
    EXPECT_NEAR(truth.force().real(), acts, 1e-12) << k;
  }
  EXPECT_NEAR(acts, -8.5, 1e-12);
}

struct GapClock {
  VirtualRig& rig;
  long gap = 0;
  long wait() noexcept {
    for (long i = 0; i < gap && !rig.done(); ++i) rig.advance();
    return std::exchange(gap, 0);
  }
};

/// A feedforward of the true unbalance: all of its force turns with the rotor.
struct Feedforward {
  RigParameters p;
  Expected<Command, Fault> step(const Measurement& m) const noexcept {
    const std::complex<double> e = p.eccentricity() * p.rotor.mass * m.omega * m.omega;
    const std::complex<double> u = -e * std::polar(1.0, m.beta + m.omega * 1.2e-3);
    return Command{u.real(), u.imag()};
  }
  void applied(const Command&) const noexcept {}
};

// Every 0.2 s a gap of 20 ticks, at top speed more than half a turn.
double peak(bool turns, long gap) {
  RigParameters p = plain();
  p.actuator.turns_held_force = turns;
  p.profile = {.omega_start = 130, .omega_end = 130, .ramp_time = 3};
  p.rotor.stiffness_split = p.rotor.damping_split = p.rotor.cross_stiffness = 0;
  VirtualRig rig(p, {});
  const RigTruth truth(rig);
  Feedforward law{p};
  GapClock clock{rig};
  rt::Loop loop(rig, law, clock);
  double most = 0;
  for (long k = 1; !rig.done(); ++k) {
    if (gap > 0 && k % 200 == 0) clock.gap = gap;
    loop.cycle();
    if (rig.time() > 1) most = std::max(most, std::abs(truth.z()));
  }
  return most;
}

TEST(HeldForceProperty, InAGapTheForceTurnsOnWhereTheBoardCan) {
  const double without = peak(false, 0), still = peak(false, 20), turned = peak(true, 20);
  EXPECT_GT(still, 3 * without);
  EXPECT_LT(turned, 1.5 * without);
  std::printf("no gaps %.3f mm, held %.3f mm, turned %.3f mm\n", 1e3 * without, 1e3 * still, 1e3 * turned);
}

// Beyond a sixth of a turn a force that stands still is worse than none.
TEST(HeldForceReference, TheLongestGapOfAForceThatStandsStillIsASixthOfATurn) {
  for (const double omega : {20.0, 130.0, -400.0}) {
    const double longest = rt::longest_held_gap(omega);
    EXPECT_NEAR(std::abs(std::polar(1.0, omega * longest) - 1.0), 1, 1e-12);
    EXPECT_LT(std::abs(std::polar(1.0, 0.9 * omega * longest) - 1.0), 1);
  }
  EXPECT_TRUE(std::isinf(rt::longest_held_gap(0)));
}

}  // namespace
}  // namespace whirl::rig
