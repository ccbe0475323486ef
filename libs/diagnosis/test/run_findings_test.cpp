// Runs through a critical speed: the size of 1X, the free vibration after it, the frequency of the largest line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/vibration.hpp"
#include "whirl/diagnosis/vibration_findings.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;

/// A run of constant acceleration.
struct Run {
  double start, alpha, dt;  // rad/s, rad/s^2, s
  Eigen::Index samples;
  double angle(double t) const { return start * t + 0.5 * alpha * t * t; }
};

/// x = Re z of z'' + 2 zeta w z' + w^2 z = e (Omega^2 - i alpha) e^{i beta}, by Runge-Kutta, `parts` steps a sample.
Eigen::VectorXd whirl_of(double w, double zeta, double e, const Run& run, int parts = 1) {
  Eigen::VectorXd x(run.samples);
  Complex z = 0, v = 0;
  const auto rate = [&](double t, Complex place, Complex speed) {
    const double omega = run.start + run.alpha * t;
    return -2 * zeta * w * speed - w * w * place +
           e * Complex(omega * omega, -run.alpha) * std::polar(1.0, run.angle(t));
  };
  const double h = run.dt / parts;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = z.real();
    for (int part = 0; part < parts; ++part) {
      const double t = run.dt * static_cast<double>(i) + part * h;
      const Complex a1 = rate(t, z, v), v2 = v + 0.5 * h * a1, a2 = rate(t + 0.5 * h, z + 0.5 * h * v, v2);
      const Complex v3 = v + 0.5 * h * a2, a3 = rate(t + 0.5 * h, z + 0.5 * h * v2, v3);
      const Complex v4 = v + h * a3, a4 = rate(t + h, z + h * v3, v4);
      z += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  }
  return x;
}

Recording recorded(const Run& run, Eigen::VectorXd x) {
  Eigen::VectorXd beta(run.samples);
  for (Eigen::Index i = 0; i < run.samples; ++i) beta[i] = run.angle(run.dt * static_cast<double>(i));
  Recording record;
  record.dt = run.dt;
  record.add("x", Quantity::displacement, std::move(x));
  record.add("beta", Quantity::angle, std::move(beta));
  return record;
}

/// From 1 to 30 Hz in 14 s. `size`: of a vibration at `order` times the speed.
Recording run_up(std::uint64_t seed, double size, double order = 0.45) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 2e-6);
  std::uniform_real_distribution<double> even(0, 1);
  const double w = kTwoPi * (10 + 5 * even(random)), zeta = 0.004 + 0.004 * even(random);
  const Run run{kTwoPi, kTwoPi * 29 / 14, 1e-3, 14000};
  Eigen::VectorXd x = whirl_of(w, zeta, 2e-4, run);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x[i] += noise(random) + size * std::cos(order * run.angle(run.dt * static_cast<double>(i)));
  return recorded(run, std::move(x));
}

bool names(const VibrationFinding& f, Cause cause) { return std::ranges::count(f.causes, cause) > 0; }

TEST(RunFindingsProperty, FreeVibrationAfterThePassageIsNoOrderAndTheFirstOrderIsThatOfTheCurve) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Recording record = run_up(seed, 0);
    const VibrationFindings found = find_vibration(record);
    const VibrationFinding* first = found.find(VibrationCode::first_order, "x");
    ASSERT_NE(first, nullptr);
    const auto curve = order_curve(record, *rotation_of(record), "x");
    EXPECT_DOUBLE_EQ(first->size, curve.vector.cwiseAbs().maxCoeff());
    for (const VibrationFinding& f : found.findings) {
      EXPECT_NE(f.code, VibrationCode::half_orders) << seed;
      EXPECT_NE(f.code, VibrationCode::subsynchronous) << seed;
    }
  }
}

// A half order that follows the speed is there before the passage too: no draw loses it to the ringing.
TEST(RunFindingsProperty, AHalfOrderThatFollowsTheSpeedStaysOne) {
  for (std::uint64_t seed = 211; seed <= 220; ++seed) {
    const VibrationFindings found = find_vibration(run_up(seed, 1e-3, 0.5));
    const VibrationFinding* half = found.find(VibrationCode::half_orders, "x");
    ASSERT_NE(half, nullptr) << seed;
    EXPECT_FALSE(names(*half, Cause::free_vibration)) << seed;
    EXPECT_GT(half->size, 0.7e-3) << seed;  // the ringing adds where it crosses
  }
}

/// From 5 to 166 Hz in 60 s through two critical speeds: the second one has the largest vector, the first one rings
/// where half the speed and a half more pass its frequency.
Recording two_passages(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> even(0, 1);
  const double first = kTwoPi * (11 + 5 * even(random)), second = kTwoPi * (135 + 20 * even(random));
  const Run run{kTwoPi * 5, kTwoPi * 161 / 60, 1e-3, 60000};
  Eigen::VectorXd x =
      whirl_of(first, 0.004 + 0.012 * even(random), 1e-5, run, 2) + whirl_of(second, 0.015, 3e-5, run, 2);
  std::normal_distribution<double> noise(0, 2e-6);
  for (double& value : x) value += noise(random);
  return recorded(run, std::move(x));
}

// Also where a later passage is the larger one.
TEST(RunFindingsProperty, TheRingingOfASmallerPassageIsNoLooseness) {
  for (const std::uint64_t seed : {1, 2, 3, 11}) {
    for (const VibrationFinding& f : find_vibration(two_passages(seed)).findings) {
      if (f.code != VibrationCode::subsynchronous && f.code != VibrationCode::half_orders) continue;
      EXPECT_TRUE(names(f, Cause::free_vibration)) << seed << ": " << f.order << "X at " << f.speed / kTwoPi << " Hz";
    }
  }
}

// From 1 Hz through 10 to 15 Hz in 14 s: five turns or so are slow enough, and it was said that there were none.
TEST(RunFindings, ARunThatPassesTheSlowSpeedsTooFastForTheRunOutSaysSo) {
  const VibrationFindings found = find_vibration(run_up(1, 0));
  const auto at = std::ranges::find(found.unjudged, std::optional(VibrationCode::run_out), &Unjudged::code);
  ASSERT_NE(at, found.unjudged.end());
  EXPECT_EQ(at->reason, UnjudgedReason::few_slow_turns);
}

// A whirl that follows the speed is there before the passage too: in every draw it stays a whirl.
TEST(RunFindingsProperty, AWhirlThatFollowsTheSpeedStaysAWhirl) {
  int seen = 0;
  for (std::uint64_t seed = 101; seed <= 140; ++seed) {
    const VibrationFindings found = find_vibration(run_up(seed, 1e-3));
    const VibrationFinding* whirl = found.find(VibrationCode::subsynchronous, "x");
    if (whirl == nullptr) continue;
    ++seen;
    EXPECT_FALSE(names(*whirl, Cause::free_vibration)) << seed;
    EXPECT_TRUE(names(*whirl, Cause::oil_whirl) || names(*whirl, Cause::oil_whip)) << seed;
  }
  EXPECT_GE(seen, 20);
}

TEST(VibrationLineProperty, TheFrequencyOfATwoToneRecordLiesBetweenItsLines) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> even(0, 1);
  std::normal_distribution<double> noise(0, 1e-7);
  for (int n = 0; n < 30; ++n) {
    const double f = 5 + 40 * even(random), phase = kTwoPi * even(random);
    Recording record;
    record.dt = 1e-3;
    Eigen::VectorXd x(12000);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      const double t = 1e-3 * static_cast<double>(i);
      x[i] = 1e-5 * std::cos(kTwoPi * f * t + phase) + 3e-6 * std::cos(kTwoPi * 120 * t) + noise(random);
    }
    record.add("x", Quantity::displacement, x);
    EXPECT_NEAR(vibration_of(record, {}).front().frequency, f, 0.02) << n;
  }
}

}  // namespace
}  // namespace whirl::diagnosis
