#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/monitor/spectrum_average.hpp"
#include "whirl/monitor/synchronous.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd tone(Index n, double amplitude, double cycles_per_sample, Index from = 0) {
  MatrixXd x(n, 1);
  for (Index i = 0; i < n; ++i)
    x(i, 0) = amplitude * std::cos(2 * std::numbers::pi * cycles_per_sample * static_cast<double>(from + i));
  return x;
}

TEST(MonitorSpectrum, LineShowsTheAmplitudeOfATone) {
  for (const signal::Window window : {signal::Window::hann, signal::Window::flat_top, signal::Window::rectangular}) {
    SpectrumAverage s(1, 1000, {.block = 256, .window = window});
    EXPECT_EQ(s.push(tone(1024, 2e-3, 32.0 / 256)), 7);  // half overlap
    EXPECT_NEAR(s.amplitude()(32, 0), 2e-3, 1e-9);
    EXPECT_DOUBLE_EQ(s.line_spacing(), 1000.0 / 256);
  }
}

TEST(MonitorSpectrum, AveragesFollowTheirDefinition) {
  const SpectrumSettings base{.block = 64, .window = signal::Window::rectangular, .overlap = 0, .averages = 4};
  const auto run = [&](Averaging averaging) {
    SpectrumSettings settings = base;
    settings.averaging = averaging;
    SpectrumAverage s(1, 64, settings);
    for (const double a : {1.0, 2.0, 3.0, 4.0, 5.0}) s.push(tone(64, a, 8.0 / 64));
    return std::pow(s.amplitude()(8, 0), 2);
  };
  EXPECT_NEAR(run(Averaging::linear), (1 + 4 + 9 + 16) / 4.0, 1e-9);  // the fifth block comes too late
  EXPECT_NEAR(run(Averaging::peak_hold), 25, 1e-9);
  EXPECT_NEAR(run(Averaging::exponential), 7.5 + (25 - 7.5) / 4, 1e-9);
}

TEST(MonitorSpectrum, FewLostSamplesAreBridgedAndCounted) {
  SpectrumAverage s(1, 1000, {.block = 1024, .overlap = 0});
  MatrixXd x = tone(2048, 2e-3, 25.0 / 1024);
  for (const Index i : {0, 100, 101, 102, 500, 1023}) x(i, 0) = NAN;
  EXPECT_EQ(s.push(x), 2);
  EXPECT_EQ(s.count(), 2);
  EXPECT_EQ(s.bridged(), 1);
  EXPECT_EQ(s.skipped(), 0);
  EXPECT_NEAR(s.amplitude()(25, 0), 2e-3, 2e-3 * 1e-3);
  EXPECT_LT(s.amplitude()(200, 0), 2e-3 * 1e-3) << "the bridges are no noise";
  for (Index i = 0; i < 11; ++i) x(300 + i, 0) = NAN;  // over one in a hundred
  s.reset();
  s.push(x);
  EXPECT_EQ(s.count(), 1);
  EXPECT_EQ(s.skipped(), 1);
}

TEST(MonitorSpectrum, BlocksOfAboutAHertz) {
  EXPECT_EQ(block_for(1000), 1024);
  EXPECT_EQ(block_for(10'000), 8192);
  EXPECT_EQ(block_for(20), 256);
  EXPECT_EQ(block_for(1e6), 32768);
}

TEST(MonitorSpectrum, BlockWithALostSampleIsLeftOut) {
  SpectrumAverage s(1, 64, {.block = 64, .overlap = 0});
  MatrixXd x = tone(192, 1, 8.0 / 64);
  x(70, 0) = NAN;
  EXPECT_EQ(s.push(x), 3);
  EXPECT_EQ(s.count(), 2);
  EXPECT_EQ(s.skipped(), 1);
  EXPECT_NEAR(s.amplitude()(8, 0), 1, 1e-9);
  s.reset();
  EXPECT_EQ(s.count(), 0);
  EXPECT_THROW(SpectrumAverage(1, 64, {.block = 10}), Error);
}

TEST(MonitorSynchronous, VectorOfAKnownWhirl) {
  // x = Re(Z exp(j beta)), y lags a quarter turn; a third harmonic must not be seen. Angle wrapped as an encoder gives
  // it.
  const double rate = 2000, speed = 2 * std::numbers::pi * 24.3;
  const std::complex<double> z = std::polar(1e-3, 0.7);
  const Index n = 4000;
  VectorXd beta(n);
  MatrixXd xy(n, 2);
  for (Index i = 0; i < n; ++i) {
    const double b = 0.3 + speed * static_cast<double>(i) / rate;
    beta(i) = std::remainder(b, 2 * std::numbers::pi);
    xy(i, 0) = (z * std::polar(1.0, b)).real() + 2e-4 * std::cos(3 * b) + 5e-4;
    xy(i, 1) = (z * std::polar(1.0, b - std::numbers::pi / 2)).real();
  }
  for (const double direction : {1.0, -1.0}) {
    SynchronousTracker tracker(2, rate);
    std::size_t turns = 0;
    for (Index from = 0; from < n; from += 100) {  // in pieces, as frames come
      for (const auto& turn : tracker.push(direction * beta.segment(from, 100), xy.middleRows(from, 100))) {
        ++turns;
        EXPECT_NEAR(turn.speed, direction * speed, 1e-6 * speed);
        const std::complex<double> expected = direction > 0 ? z : std::conj(z);
        EXPECT_LT(std::abs(turn.vector(0) - expected), 3e-3 * std::abs(z));
      }
    }
    EXPECT_EQ(turns, 48U);
  }
}

TEST(MonitorSynchronous, LostSampleDropsItsTurn) {
  VectorXd beta(400);
  MatrixXd x(400, 1);
  for (Index i = 0; i < 400; ++i) {
    beta(i) = 2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / 100;
    x(i, 0) = std::cos(beta(i));
  }
  x(150, 0) = NAN;
  SynchronousTracker tracker(1, 1000);
  const auto turns = tracker.push(beta, x);
  ASSERT_EQ(turns.size(), 3U);  // samples 0-100, then 151-251, 251-351
  for (const auto& turn : turns) EXPECT_NEAR(std::abs(turn.vector(0)), 1, 2e-3);
}

}  // namespace
}  // namespace whirl::monitor
