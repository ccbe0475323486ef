#include "whirl/signal/even_grid.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

double motion(double t) { return std::sin(6 * t) + 0.3 * std::cos(17 * t + 1); }

VectorXd times_of(Index n, double step, const std::function<double()>& late, const std::function<double()>& longer) {
  VectorXd t(n);
  double clock = 0;
  for (Index i = 0; i < n; ++i) {
    t[i] = clock + late();
    clock += step * (1 + longer());
  }
  return t;
}

double correlation(const VectorXd& v, Index lag) {
  const Index n = v.size() - lag;
  return v.head(n).dot(v.tail(n)) / v.squaredNorm();
}

// Clocks of loggers: stamps that jitter about an even time, a loop whose every turn takes its own time, both.
TEST(EvenGridProperty, NoiseOfReadingsAtUnevenTimesStaysWhiteAndOfItsSize) {
  constexpr Index n = 6000;
  constexpr double step = 0.01;
  for (const std::uint64_t seed : {1, 2, 3}) {
    for (const int clock : {0, 1, 2}) {
      for (const double sd : {0.2, 0.02, 0.001}) {
        std::mt19937_64 random(100 * seed + static_cast<std::uint64_t>(clock));
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<double> uniform(-1, 1);
        const VectorXd t = times_of(
            n, step, [&] { return clock == 1 ? 0 : 0.3 * step * uniform(random); },
            [&] { return clock == 0 ? 0 : 0.25 * uniform(random); });
        VectorXd x(n);
        for (Index i = 0; i < n; ++i) x[i] = motion(t[i]) + sd * normal(random);
        const double mean_step = (t[n - 1] - t[0]) / (n - 1);
        const VectorXd even = onto_even_grid(t, x, t[0], mean_step, n - 1);
        VectorXd noise(even.size());
        for (Index k = 0; k < even.size(); ++k) noise[k] = even[k] - motion(t[0] + mean_step * static_cast<double>(k));
        const std::string which = fmt::format("seed {}, clock {}, sd {}", seed, clock, sd);
        EXPECT_NEAR(std::sqrt(noise.squaredNorm() / static_cast<double>(n)), sd, 0.04 * sd) << which;
        EXPECT_NEAR(noise_sd(even), sd, 0.08 * sd) << which;
        for (Index lag = 1; lag <= 6; ++lag) EXPECT_NEAR(correlation(noise, lag), 0, 0.06) << which << ", lag " << lag;
      }
    }
  }
}

TEST(EvenGrid, MotionWithoutNoiseIsReadOffTheCurve) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const VectorXd t = times_of(
      3000, 0.005, [&] { return 0.0015 * uniform(random); }, [] { return 0; });
  const VectorXd even = onto_even_grid(t, t.unaryExpr(&motion), 0.1, 0.004, 3000);
  for (Index k = 0; k < 3000; ++k) EXPECT_NEAR(even[k], motion(0.1 + 0.004 * static_cast<double>(k)), 2e-5) << k;
}

TEST(EvenGrid, AHeldOutputKeepsItsLastReading) {
  VectorXd t(60), u(60);
  for (Index i = 0; i < 60; ++i) {
    t[i] = static_cast<double>(i) + 0.3 * std::sin(2.0 * static_cast<double>(i));
    u[i] = i / 20;
  }
  const VectorXd even = onto_even_grid(t, u, 0.5, 1, 58);
  for (const double v : even) EXPECT_EQ(v, std::round(v));
  EXPECT_EQ(even[0], 0);
  EXPECT_EQ(even[57], 2);
}

TEST(EvenGrid, ASlowMotionInCountsOfAConverterIsAMotion) {
  VectorXd t(600);
  for (Index i = 0; i < 600; ++i) t[i] = static_cast<double>(i) + 0.3 * std::sin(2.0 * static_cast<double>(i));
  const VectorXd even = onto_even_grid(t, (0.4 * t).array().round(), 0.5, 1, 590);
  Index whole = 0;
  for (const double v : even) whole += v == std::round(v);
  EXPECT_LT(whole, 60);
}

TEST(EvenGrid, OutsideOfTheTimesIsNaNAndWhatHasNoMeaningIsRefused) {
  const VectorXd t = VectorXd::LinSpaced(40, 0, 39), x = t.array().square();
  const VectorXd even = onto_even_grid(t, x, -2, 1, 45);
  EXPECT_TRUE(std::isnan(even[1]) && std::isnan(even[42]));
  EXPECT_EQ(even[2], 0);
  EXPECT_EQ(even[41], 39 * 39);
  EXPECT_TRUE(onto_even_grid(t, x, 50, 1, 3).array().isNaN().all());
  EXPECT_THROW(onto_even_grid(t, x.head(39), 0, 1, 3), Error);
  EXPECT_THROW(onto_even_grid(t, x, 0, 0, 3), Error);
  EXPECT_THROW(onto_even_grid(t.reverse(), x, 0, 1, 3), Error);
}

TEST(EvenGrid, TheStepLeavesFewInstantsEmpty) {
  const VectorXd even = VectorXd::LinSpaced(100, 0, 9.9);
  EXPECT_EQ(even_step(even, 0.1), 0.1);
  std::mt19937_64 random(8);
  std::exponential_distribution<double> until_next(10);
  const VectorXd t = times_of(
      5000, 1, [] { return 0; }, [&] { return until_next(random) - 1; });
  const double step = even_step(t, 0.1);
  EXPECT_GT(step, 0.11);
  EXPECT_LT(step, 0.19);
  EXPECT_THROW(even_step(even.head(1), 0.1), Error);
  EXPECT_THROW(even_step(even, -1), Error);
}

}  // namespace
}  // namespace whirl::signal
