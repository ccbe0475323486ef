#include "whirl/signal/derivative.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/signal/filter.hpp"
#include "whirl/signal/resample.hpp"

namespace whirl::signal {
namespace {

Eigen::VectorXd sampled(Eigen::Index n, double dt, double (*f)(double)) {
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) x[i] = f(static_cast<double>(i) * dt);
  return x;
}
double wave(double t) { return std::sin(7 * t) + 0.3 * std::cos(3 * t + 0.4); }
double wave1(double t) { return 7 * std::cos(7 * t) - 0.9 * std::sin(3 * t + 0.4); }
double wave2(double t) { return -49 * std::sin(7 * t) - 2.7 * std::cos(3 * t + 0.4); }

TEST(CentralDifferenceConvergence, ObservedOrderIsTheNominalOne) {
  for (int order : {2, 4, 6}) {
    double previous = 0;
    for (int n : {101, 201, 401}) {
      const double dt = 2.0 / (n - 1);
      const Eigen::VectorXd d = central_difference(sampled(n, dt, wave), dt, order);
      const Eigen::VectorXd truth = sampled(n, dt, wave1).segment(order / 2, n - order);
      const double error = (d - truth).norm() / std::sqrt(static_cast<double>(d.size()));
      if (previous > 0) {
        EXPECT_NEAR(std::log2(previous / error), order, 0.15) << "order " << order << ", n " << n;
      }
      previous = error;
    }
  }
}

TEST(CentralDifferenceProperty, OrderFourIsExactForQuarticPolynomials) {
  const double dt = 0.1;
  const Eigen::VectorXd x =
      sampled(30, dt, [](double t) { return 1 + t - 2 * t * t + 0.5 * t * t * t - t * t * t * t; });
  const Eigen::VectorXd truth = sampled(30, dt, [](double t) { return 1 - 4 * t + 1.5 * t * t - 4 * t * t * t; });
  EXPECT_LT((central_difference(x, dt, 4) - truth.segment(2, 26)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(CentralDifference, RefusesUnknownOrderAndShortRecords) {
  const Eigen::VectorXd x = Eigen::VectorXd::Zero(4);
  EXPECT_THROW(central_difference(x, 1, 3), Error);
  EXPECT_THROW(central_difference(x, 1, 4), Error);
}

TEST(SmoothingSplineProperty, NoSmoothingInterpolatesAndStrongSmoothingGivesTheLeastSquaresLine) {
  const double dt = 0.02;
  const Eigen::VectorXd x = sampled(200, dt, wave);
  const SmoothedSignal s = smoothing_spline(x, dt, 0);
  EXPECT_LT((s.value - x).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((s.first - sampled(200, dt, wave1)).segment(20, 160).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_LT((s.second - sampled(200, dt, wave2)).segment(20, 160).cwiseAbs().maxCoeff(), 0.1);
  const SmoothedSignal line = smoothing_spline(x, dt, 1e9);
  EXPECT_LT(line.second.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_NEAR((line.value - x).sum(), 0, 1e-6);
}

TEST(SmoothingSplineProperty, DiscrepancyRuleLeavesTheNoise) {
  const double dt = 0.005;
  Eigen::VectorXd x = sampled(2000, dt, wave);
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal(0, 0.05);
  Eigen::VectorXd noisy = x;
  for (double& v : noisy) v += normal(engine);
  const SmoothedSignal s = smoothing_spline_for_noise(noisy, dt, 0.05);
  EXPECT_NEAR((s.value - noisy).norm() / std::sqrt(2000.0), 0.05, 1e-4);
  EXPECT_LT((s.value - x).norm() / std::sqrt(2000.0), 0.015);
}

TEST(GaussianFilterProperty, ToneIsAttenuatedByTheGaussianOfItsFrequency) {
  const double dt = 1e-3, sd = 6, w = 2 * std::numbers::pi * 40;
  Eigen::VectorXd x(1000);
  for (int i = 0; i < 1000; ++i) x[i] = std::sin(w * i * dt);
  const Eigen::VectorXd y = gaussian_filter(x, sd);
  const double gain = y.segment(100, 800).dot(x.segment(100, 800)) / x.segment(100, 800).squaredNorm();
  EXPECT_NEAR(gain, std::exp(-0.5 * std::pow(w * sd * dt, 2)), 2e-4);  // 0.32 at 40 Hz for 6 ms
}

TEST(GaussianFilterProperty, ConstantsPassUnchangedUpToTheEnds) {
  const Eigen::VectorXd y = gaussian_filter(Eigen::VectorXd::Constant(50, 3.5), 4.0);
  EXPECT_LT((y.array() - 3.5).abs().maxCoeff(), 1e-13);
  EXPECT_EQ(gaussian_filter(y, 0), y);
  // Shorter than the kernel.
  EXPECT_NEAR(gaussian_filter(Eigen::VectorXd::Constant(7, 2.0), 9.0)[3], 2.0, 1e-13);
}

TEST(UpsampleProperty, KeepsTheSamplesAndInterpolatesBandLimitedSignals) {
  const double dt = 0.05;  // 7 rad/s: 18 samples per cycle
  const Eigen::Index n = 301;
  const Eigen::VectorXd x = sampled(n, dt, wave);
  const Eigen::VectorXd y = upsample(x, 4);
  ASSERT_EQ(y.size(), (n - 1) * 4 + 1);
  for (Eigen::Index i = 0; i < n; ++i) EXPECT_NEAR(y[4 * i], x[i], 1e-12);
  const Eigen::VectorXd truth = sampled(y.size(), dt / 4, wave);
  EXPECT_LT((y - truth).segment(80, y.size() - 160).cwiseAbs().maxCoeff(), 1e-4);
}

}  // namespace
}  // namespace whirl::signal
