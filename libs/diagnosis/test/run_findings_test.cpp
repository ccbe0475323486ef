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

/// z'' + 2 zeta w z' + w^2 z = e (Omega^2 - i alpha) e^{i beta} by Runge-Kutta, x = Re z; from 1 to 30 Hz in 14 s.
/// `size`: of a vibration at `order` times the speed.
Recording run_up(std::uint64_t seed, double size, double order = 0.45) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 2e-6);
  std::uniform_real_distribution<double> even(0, 1);
  const double w = kTwoPi * (10 + 5 * even(random)), zeta = 0.004 + 0.004 * even(random), e = 2e-4, dt = 1e-3;
  const double start = kTwoPi, alpha = kTwoPi * 29 / 14;
  Eigen::VectorXd x(14000), beta(14000);
  Complex z = 0, v = 0;
  const auto angle = [&](double t) { return start * t + 0.5 * alpha * t * t; };
  const auto rate = [&](double t, Complex place, Complex speed) {
    const double omega = start + alpha * t;
    return -2 * zeta * w * speed - w * w * place + e * Complex(omega * omega, -alpha) * std::polar(1.0, angle(t));
  };
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double t = dt * static_cast<double>(i), h = dt;
    x[i] = z.real() + noise(random) + size * std::cos(order * angle(t));
    beta[i] = angle(t);
    const Complex a1 = rate(t, z, v), v2 = v + 0.5 * h * a1, a2 = rate(t + 0.5 * h, z + 0.5 * h * v, v2);
    const Complex v3 = v + 0.5 * h * a2, a3 = rate(t + 0.5 * h, z + 0.5 * h * v2, v3);
    const Complex v4 = v + h * a3, a4 = rate(t + h, z + h * v3, v4);
    z += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    v += h / 6 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
  }
  Recording record;
  record.dt = dt;
  record.add("x", Quantity::displacement, x);
  record.add("beta", Quantity::angle, beta);
  return record;
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
  const double start = kTwoPi * 5, alpha = kTwoPi * 161 / 60, dt = 1e-3;
  const double w[] = {kTwoPi * (11 + 5 * even(random)), kTwoPi * (135 + 20 * even(random))};
  const double zeta[] = {0.004 + 0.012 * even(random), 0.015}, e[] = {1e-5, 3e-5};
  std::normal_distribution<double> noise(0, 2e-6);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(60000), beta(60000);
  const auto angle = [&](double t) { return start * t + 0.5 * alpha * t * t; };
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = noise(random);
    beta[i] = angle(dt * static_cast<double>(i));
  }
  for (int k = 0; k < 2; ++k) {
    Complex z = 0, v = 0;
    const auto rate = [&](double t, Complex place, Complex speed) {
      const double omega = start + alpha * t;
      return -2 * zeta[k] * w[k] * speed - w[k] * w[k] * place +
             e[k] * Complex(omega * omega, -alpha) * std::polar(1.0, angle(t));
    };
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x[i] += z.real();
      for (int half = 0; half < 2; ++half) {  // two steps a sample
        const double h = 0.5 * dt, t = dt * static_cast<double>(i) + half * h;
        const Complex a1 = rate(t, z, v), v2 = v + 0.5 * h * a1, a2 = rate(t + 0.5 * h, z + 0.5 * h * v, v2);
        const Complex v3 = v + 0.5 * h * a2, a3 = rate(t + 0.5 * h, z + 0.5 * h * v2, v3);
        const Complex v4 = v + h * a3, a4 = rate(t + h, z + h * v3, v4);
        z += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      }
    }
  }
  Recording record;
  record.dt = dt;
  record.add("x", Quantity::displacement, x);
  record.add("beta", Quantity::angle, beta);
  return record;
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
