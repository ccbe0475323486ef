#include "whirl/response/runup.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "folds.hpp"
#include "whirl/core/error.hpp"

namespace whirl::response {
namespace {

RotorModel linear() {
  RotorModel r;
  r.k1 = 8882.6;
  r.c = 7.5;
  r.eps = {1e-4, 0.5e-4};
  return r;
}
RotorModel hardening() {
  RotorModel r = linear();
  r.k2 = 2e8;
  r.eps = {3e-4, 0};
  return r;
}

// An almost steady passage meets the largest steady answer: e w_n^2 / (c sqrt(w_n^2 - c^2 / 4)) of a linear rotor.
TEST(RunUpReference, SlowPassageOfALinearRotorIsItsSteadyPeak) {
  const RotorModel r = linear();
  // max over W of e W^2 / sqrt((k - W^2)^2 + c^2 W^2) lies at W^2 = k^2 / (k - c^2 / 2).
  const double w2 = r.k1 * r.k1 / (r.k1 - r.c * r.c / 2);
  const double top = std::abs(r.eps) * w2 / std::sqrt(std::pow(r.k1 - w2, 2) + r.c * r.c * w2);
  EXPECT_NEAR(slow_run(r, 40, 200).peak, top, 1e-5 * top);
  EXPECT_NEAR(passage(r, 70, 130, 0.2).peak, top, 2e-3 * top);
}

// Where nothing forces the rotor it stands still: at no speed, and without unbalance, however near to zero.
TEST(RunUpProperty, StandstillAndAVanishingUnbalanceHaveTheAnswerZero) {
  for (RotorModel r : {linear(), hardening()}) {
    const auto still = synchronous_answers(r, 0);
    ASSERT_EQ(still.size(), 1U);
    EXPECT_EQ(still[0].radius, 0);
    EXPECT_TRUE(still[0].stable);
    for (const double e : {0.0, 1e-300, 1e-160, 1e-100, 1e-30}) {
      r.eps = e;
      for (const double omega : {1e-300, 1e-30, 1e-3, 94.0, 200.0}) {
        const auto answers = synchronous_answers(r, omega);
        ASSERT_FALSE(answers.empty()) << e << " " << omega;
        EXPECT_GE(answers[0].radius, 0);
        EXPECT_LE(answers[0].radius, 20 * e) << omega;
      }
    }
  }
  const RunUpPlan plan = plan_run_up(hardening(), {.from = 0, .to = 200, .rates = 3});
  EXPECT_GT(plan.up.passages.front().peak, std::abs(hardening().eps));
}

// Lewis 1932: at high acceleration the peak of a run-up of an undamped rotor falls as 1 / sqrt(rate), and it lies above
// the critical speed in a run-up, below it in a run-down.
TEST(RunUpReference, FastPassagesFallWithTheRootOfTheRate) {
  RotorModel r = linear();
  r.c = 1e-3;
  const double slow = passage(r, 1, 250, 20).peak, fast = passage(r, 1, 250, 80).peak;
  EXPECT_NEAR(slow / fast, 2, 0.2);
  EXPECT_GT(passage(r, 1, 250, 80).peak_speed, std::sqrt(r.k1));
  EXPECT_LT(passage(r, 250, 1, 80).peak_speed, std::sqrt(r.k1));
}

// Up the hardening rotor follows the upper branch to its fold, down the lower one to its own.
TEST(RunUpReference, SlowRunJumpsAtTheFolds) {
  const RotorModel r = hardening();
  const auto folds = synchronous_folds(r, 40, 200);
  ASSERT_EQ(folds.size(), 2U);
  const SlowRun up = slow_run(r, 40, 200), down = slow_run(r, 200, 40);
  ASSERT_EQ(up.jumps.size(), 1U);
  ASSERT_EQ(down.jumps.size(), 1U);
  EXPECT_NEAR(up.points[up.jumps[0]].omega, folds[1], 0.1);
  EXPECT_NEAR(down.points[down.jumps[0]].omega, folds[0], 0.1);
  EXPECT_GT(up.peak, 1.2 * down.peak);
  EXPECT_NEAR(up.peak, synchronous_peak(r, 40, 200).radius, 0.01 * up.peak);
}

TEST(RunUpProperty, SlowestSafeRateHoldsTheLimitAndALittleSlowerDoesNot) {
  const RotorModel r = hardening();
  RunUpOptions o;
  o.from = 40;
  o.to = 200;
  o.slowest = 4;
  const RunUpPlan free = plan_run_up(r, o);
  EXPECT_EQ(free.up.slowest_safe, free.up.passages.front().rate);
  std::mt19937_64 random(71);
  for (int k = 0; k < 3; ++k) {
    const double part = std::uniform_real_distribution<double>(0.3, 0.9)(random);
    o.limit = free.up.passages.back().peak + part * (free.up.passages.front().peak - free.up.passages.back().peak);
    const RunUpPlan plan = plan_run_up(r, o);
    ASSERT_TRUE(plan.up.slowest_safe);
    EXPECT_LE(passage(r, 40, 200, *plan.up.slowest_safe).peak, o.limit);
    EXPECT_GT(passage(r, 40, 200, *plan.up.slowest_safe / 1.003).peak, 0.999 * o.limit);
  }
  o.limit = 0.5 * free.up.passages.back().peak;
  EXPECT_FALSE(plan_run_up(r, o).up.slowest_safe);
}

TEST(RunUpProperty, TheRateThatDecidesIsNamedOnlyWhereThereIsOne) {
  RunUpOptions o;
  o.from = 40;
  o.to = 200;
  o.slowest = 1;
  EXPECT_LT(plan_run_up(linear(), o).up.sensitivity, 0.6);
  RotorModel strong = hardening();
  strong.k2 = 2e9;
  strong.c = 3;
  const RateCurve up = plan_run_up(strong, o).up;
  EXPECT_GT(up.sensitivity, 0.8);
}

// Slowly through the critical speed the reaction is the torque of the steady whirl at its peak.
TEST(RunUpReference, ReactionOfASlowPassageIsTheTorqueOfTheSteadyWhirl) {
  const RotorModel r = linear();
  const double mass = 1.5;
  const StallLimit steady = stall_limit(r, mass, {}, 40, 130);
  EXPECT_NEAR(mass * passage(r, 40, 130, 0.5).reaction, steady.torque, 0.01 * steady.torque);
}

// The drive stalls where the largest torque of whirl and friction exceeds its own (Sommerfeld). A heavy flywheel runs
// up quasi-statically: the coupled motion decides as the balance of torques does.
TEST(RunUpReference, StallOfTheCoupledMotionIsThatOfTheTorqueBalance) {
  for (const RotorModel& r : {linear(), hardening()}) {
    rotor::TorqueModel torque;
    torque.viscous = 1e-4;
    torque.coulomb = 2e-3;
    const double mass = 1.5, inertia = 0.02;
    const StallLimit limit = stall_limit(r, mass, torque, 80, 125);
    torque.motor = 1.01 * limit.torque;
    EXPECT_TRUE(driven_run_up(r, mass, inertia, torque, 80, 125, 1500).reached);
    torque.motor = 0.99 * limit.torque;
    const DrivenRunUp stalled = driven_run_up(r, mass, inertia, torque, 80, 125, 1500);
    EXPECT_FALSE(stalled.reached);
    EXPECT_NEAR(stalled.final_speed, limit.speed, 0.05 * limit.speed);
  }
}

TEST(RunUp, BadInputIsRefused) {
  RunUpOptions o;
  o.from = 40;
  o.to = 40;
  EXPECT_THROW(plan_run_up(linear(), o), Error);
  o.to = 200;
  o.limit = -1;
  EXPECT_THROW(plan_run_up(linear(), o), Error);
  EXPECT_THROW(passage(linear(), 40, 200, 0), Error);
  EXPECT_THROW(driven_run_up(linear(), 0, 1, {}, 40, 200, 1), Error);
}

}  // namespace
}  // namespace whirl::response
