#include "whirl/control/reidentifier.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;

constexpr double kDesignStep = 1e-3;

/// A rotor whose stiffness, damping and gain differ from the settings' by these shares, in steady whirl under the
/// unbalance and a control acceleration that turns with it.
struct Steady {
  ReidentifierSettings s{{3600, 0, 6, {}, {}}, {1e-4, 5e-5}, kDesignStep, {0.2, 1, 0.3}};
  double dk = 0, dc = 0, dg = 0;
  double direction = 1;
  Complex eps{1.4e-4, -2e-5}, runout{4e-6, -3e-6};

  /// Whole windows at that speed; `force`: control acceleration at the angle zero, m/s^2.
  void turn(Reidentifier& r, double omega, Complex force, int windows, bool frozen = false) {
    const double w = direction * omega;
    const Complex i{0, 1}, stiffness(s.model.k1 * (1 + dk) - w * w, s.model.c * (1 + dc) * w);
    const Complex z = ((1 + dg) * force + w * w * eps) / stiffness + runout;
    for (int k = 0; k < windows * 6 * std::numbers::pi / (omega * kDesignStep); ++k) {
      beta += w * kDesignStep;
      ReidentifierInput in;
      in.turn = std::exp(i * beta);
      in.half = std::exp(i * (0.5 * w * kDesignStep));
      in.z = z * in.turn;
      in.a = force * in.turn * std::conj(in.half);
      in.forcing = w * w * in.turn;
      in.omega = w;
      in.frozen = frozen;
      last = r.step(in);
    }
  }
  double beta = 0;
  Reidentification last;
};

// Two forces at two speeds: eight equations for eight unknowns, the runout among them. What the prior leaves of an
// exact answer is far below a standard deviation.
TEST(ReidentifierReference, SteadyWhirlUnderDifferentForcesDeterminesStiffnessDampingAndGain) {
  for (const double direction : {1.0, -1.0}) {
    Steady m;
    m.direction = direction;
    m.dk = -0.12, m.dc = 0.5, m.dg = -0.2;
    Reidentifier r(m.s);
    for (int k = 0; k < 20; ++k) {
      for (const double omega : {50.0, 57.0, 66.0, 80.0}) {
        m.turn(r, omega, {0.3, 0.1}, 1);
        m.turn(r, omega, {-0.2, 0.3}, 1);
      }
    }
    EXPECT_EQ(m.last.word, 7u) << direction;
    const double truth[] = {m.dk, m.dc, m.dg};
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(m.last.estimate[i], truth[i], 0.5 * m.last.sd[i]) << i;
      EXPECT_EQ(m.last.acting[i], m.last.estimate[i]) << i;
    }
    EXPECT_LT(m.last.sd[0], 0.01);
    EXPECT_NEAR(m.last.estimate[0], m.dk, 1e-3);
    EXPECT_NEAR(m.last.estimate[2], m.dg, 3e-3);
  }
}

// No motion, no force, one condition: nothing is claimed and nothing acts.
TEST(ReidentifierReference, WhatTheMotionDoesNotTellIsRefused) {
  Steady still;
  still.eps = still.s.eps = still.runout = 0;
  Reidentifier r(still.s);
  still.turn(r, 60, 0, 30);
  EXPECT_EQ(still.last.word, kUndetermined);
  Steady one;
  one.dk = -0.15, one.dg = -0.25;
  Reidentifier alone(one.s);
  one.turn(alone, 90, {0.5, 0.2}, 60);
  EXPECT_EQ(one.last.word & (kActuatorKnown | kDampingKnown), 0u);
  EXPECT_EQ(one.last.acting, MachineShares{});
  // Without a force the stiffness is known, and nothing is corrected: the gain is not.
  Steady open;
  open.dk = -0.15;
  Reidentifier without(open.s);
  for (int k = 0; k < 10; ++k) {
    for (const double omega : {48.0, 52.0, 56.0, 60.0, 70.0}) open.turn(without, omega, 0, 1);
  }
  EXPECT_NE(open.last.word & kStiffnessKnown, 0u);
  EXPECT_EQ(open.last.word & kActuatorKnown, 0u);
  EXPECT_NEAR(open.last.estimate[0], open.dk, 2 * open.last.sd[0]);
  EXPECT_EQ(open.last.acting, MachineShares{});
}

TEST(ReidentifierReference, BoundsHoldAndAnotherMachineGetsTheDesignsNumbers) {
  const auto learned = [](double dg, double dk) {
    Steady m;
    m.dg = dg, m.dk = dk;
    Reidentifier r(m.s);
    for (int k = 0; k < 20; ++k) {
      for (const double omega : {50.0, 57.0, 66.0, 80.0}) {
        m.turn(r, omega, {0.3, 0.1}, 1);
        m.turn(r, omega, {-0.2, 0.3}, 1);
      }
    }
    return m.last;
  };
  const Reidentification most = learned(-0.4, 0);
  EXPECT_NE(most.word & kActuatorBound, 0u);
  EXPECT_EQ(most.word & kOtherMachine, 0u);
  EXPECT_EQ(most.acting[2], -0.3);
  for (const Reidentification& other : {learned(-2, 0), learned(0, -0.6)}) {
    EXPECT_NE(other.word & kOtherMachine, 0u);
    EXPECT_EQ(other.acting, MachineShares{});
  }
}

// The correction moves by a sixtieth of its bound per turn, stands while frozen, and ends where supervision steps in.
TEST(ReidentifierReference, TheCorrectionMovesSlowlyAndGoesBackWhereSupervisionStepsIn) {
  Steady m;
  m.dg = -0.25;
  Reidentifier r(m.s);
  double before = 0, fastest = 0;
  for (int k = 0; k < 160; ++k) {
    m.turn(r, 50 + 7 * (k % 4), k % 8 < 4 ? Complex(0.3, 0.1) : Complex(-0.2, 0.3), 1);
    fastest = std::max(fastest, std::abs(m.last.acting[2] - before));
    before = m.last.acting[2];
  }
  EXPECT_LT(before, -0.2);
  EXPECT_LT(fastest, 3.1 * 0.3 / 60);
  m.turn(r, 60, 0, 5, true);
  EXPECT_NE(m.last.word & kReidentifierFrozen, 0u);
  EXPECT_NEAR(m.last.acting[2], before, 1e-3);
  ReidentifierInput in;
  in.turn = in.half = 1;
  in.omega = 60;
  in.taken = true;
  for (int k = 0; k < 8000; ++k) m.last = r.step(in);
  EXPECT_EQ(m.last.acting, MachineShares{});
}

TEST(ReidentifyUnit, IsPartOfTheSupervisionAndRefusedByNameWhereItCannotAct) {
  ControllerDesign d = testing::design_of("pd", "lpf");
  d.parameters["reidentify"] = 2;
  EXPECT_EQ(make_controller(d).settings().reidentify, Reidentify::off);
  d.parameters["supervise"] = 1;
  EXPECT_EQ(make_controller(d).settings().reidentify, Reidentify::acts);
  ControllerDesign undamped = d;
  undamped.model.c = 0;
  EXPECT_THROW(make_controller(undamped), Error);
  ControllerDesign finds = testing::design_of("pd", "kfe");
  finds.parameters["supervise"] = 1;
  finds.parameters["reidentify"] = 1;
  EXPECT_EQ(make_controller(finds).settings().reidentify, Reidentify::says);
  finds.parameters["reidentify"] = 2;
  EXPECT_THROW(make_controller(finds), Error);
}

}  // namespace
}  // namespace whirl::control
