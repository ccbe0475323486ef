#include "whirl/signal/motion_quantity.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
constexpr double kCircle = 2 * std::numbers::pi;

/// Tones of known velocity (rms, m/s) seen by an accelerometer that has an offset and drifts slowly.
struct Accelerometer {
  VectorXd acceleration, velocity;
  double inside = 0;  ///< rms velocity of the tones from 10 Hz to 1 kHz

  Accelerometer(std::uint64_t seed, double rate, double seconds) {
    std::mt19937_64 draw(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto n = static_cast<Index>(rate * seconds);
    const VectorXd t = VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1) / rate);
    // 2 m/s^2 of offset and a drift that is 30 mm/s of velocity at 0.3 Hz.
    const double slow = kCircle * 0.3;
    acceleration = 2 + 30e-3 * slow * std::numbers::sqrt2 * (slow * t.array()).sin();
    velocity = VectorXd::Zero(n);
    for (int k = 0; k < 5; ++k) {
      // Apart by a fifth or more: two tones that beat slowly have no rms of a few seconds.
      const double f = 12 * std::pow(75, (k + 0.8 * unit(draw)) / 5), rms = 1e-3 * (0.2 + unit(draw)),
                   phase = kCircle * unit(draw);
      const double w = kCircle * f, peak = std::numbers::sqrt2 * rms;
      velocity.array() += peak * (w * t.array() + phase).sin();
      acceleration.array() += peak * w * (w * t.array() + phase).cos();
      inside += rms * rms;
    }
    inside = std::sqrt(inside);
    // Beyond the band: as large again.
    const double w = kCircle * 1500;
    acceleration.array() += 1e-3 * std::numbers::sqrt2 * w * (w * t.array()).cos();
  }
};

TEST(MotionQuantityProperty, VelocityOfAnAccelerometerIsCalibrated) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const double rate = seed % 2 == 0 ? 5120 : 12000;
    const Accelerometer sensor(seed, rate, 6.3);
    const auto level = band_level(sensor.acceleration, 1 / rate, 1);
    ASSERT_TRUE(level);
    EXPECT_NEAR(level->rms / sensor.inside, 1, 0.01) << seed;
    EXPECT_GE(level->largest, level->rms);
    EXPECT_NEAR(level->below / 30e-3, 1, 0.2) << seed;
    EXPECT_EQ(level->high, 1000);
    const VectorXd v = integrated(sensor.acceleration, 1 / rate, 1);
    const Index ends = static_cast<Index>(0.3 * rate), middle = v.size() - 2 * ends;
    const double error =
        (v - sensor.velocity).segment(ends, middle).norm() / sensor.velocity.segment(ends, middle).norm();
    EXPECT_LT(error, 0.01) << seed;
    // And back: the velocity differentiated, by the same rule.
    const VectorXd a = integrated(v, 1 / rate, -1);
    const VectorXd again = integrated(a, 1 / rate, 1);
    EXPECT_LT((again - v).segment(ends, middle).norm() / v.segment(ends, middle).norm(), 0.01) << seed;
  }
}

TEST(MotionQuantityProperty, NoiseOfKnownDensityHasTheLevelOfItsBand) {
  double sum = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    std::mt19937_64 draw(seed);
    std::normal_distribution<double> noise;
    const VectorXd x = VectorXd::NullaryExpr(Index{100000}, [&] { return noise(draw); });
    const auto level = band_level(x, 1e-4, 0);
    ASSERT_TRUE(level);
    sum += level->rms * level->rms / 8;
  }
  EXPECT_NEAR(sum, 990.0 / 5000, 0.01 * 990 / 5000);  // white: the share of the band in half the rate
}

TEST(MotionQuantity, VectorsAreConvertedExactly) {
  SynchronousCurve curve{"a", Eigen::Vector3d(10, 50, 300), Eigen::Vector3cd(1, {0, 2}, {-3, 1})};
  curve.quantity = Quantity::acceleration;
  curve.order = 2;
  const SynchronousCurve x = in_quantity(curve, Quantity::displacement);
  for (Index i = 0; i < 3; ++i) {
    const double w = 2 * curve.speed[i];
    EXPECT_LT(std::abs(x.vector[i] + curve.vector[i] / (w * w)), 1e-15);
  }
  EXPECT_LT((in_quantity(x, Quantity::acceleration).vector - curve.vector).norm(), 1e-12);
  curve.quantity = Quantity::force;
  EXPECT_THROW(in_quantity(curve, Quantity::velocity), Error);
}

TEST(MotionQuantity, WhatARecordCannotTellIsNotStated) {
  const VectorXd x = VectorXd::LinSpaced(900, 0, 1).array().sin();
  EXPECT_FALSE(band_level(x, 1e-3, 1));                    // nine periods of 10 Hz
  EXPECT_FALSE(band_level(VectorXd::Ones(900), 0.05, 1));  // 20 samples a second
  VectorXd gap = VectorXd::Ones(6000);
  for (Index i = 0; i < gap.size(); i += 1000) gap[i] = NAN;
  EXPECT_FALSE(band_level(gap, 1e-3, 1));
  EXPECT_EQ(band_level(VectorXd::LinSpaced(6000, 0, 1), 1e-3, 1)->high, 500);  // what the record holds
  EXPECT_THROW(integrated(x.head(150), 1e-3, 1), Error);
  EXPECT_THROW(integrated(x, 1e-3, 1, {20, 10}), Error);
}

}  // namespace
}  // namespace whirl::signal
