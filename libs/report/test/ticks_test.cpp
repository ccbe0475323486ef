#include "whirl/report/ticks.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace whirl::report {
namespace {

TEST(ReportTicks, LinearStepsAreOneTwoFive) {
  const Ticks t = linear_ticks(-0.37, 0.62, 6);
  ASSERT_EQ(t.labels, (std::vector<std::string>{"−0.2", "0.0", "0.2", "0.4", "0.6"}));
  EXPECT_NEAR(t.major.front(), -0.2, 1e-15);
  EXPECT_EQ(t.exponent, 0);
}

TEST(ReportTicks, NeverASingleTickOnAUsualAxis) {
  EXPECT_EQ(linear_ticks(-4.2, 4.3, 4).labels, (std::vector<std::string>{"−2.5", "0.0", "2.5"}));
}

TEST(ReportTicks, LargeAndSmallNumbersShareOnePowerOfTen) {
  const Ticks large = linear_ticks(0, 3.2e6, 4);
  EXPECT_EQ(large.exponent, 6);
  EXPECT_EQ(large.labels, (std::vector<std::string>{"0", "1", "2", "3"}));
  const Ticks small = linear_ticks(0, 4e-5, 5);
  EXPECT_EQ(small.exponent, -5);
  EXPECT_EQ(small.labels.back(), "4");
}

TEST(ReportTicks, DecadesOfALogarithmicAxis) {
  const Ticks t = log_ticks(0.5e-4, 20, 10);
  EXPECT_EQ(t.labels, (std::vector<std::string>{"10⁻⁴", "10⁻³", "0.01", "0.1", "1", "10"}));
  EXPECT_EQ(log_ticks(1e-12, 1e12, 6).labels.size(), 5U);
  EXPECT_EQ(log_ticks(3, 70, 8).labels, (std::vector<std::string>{"5", "10", "20", "50"}));
}

TEST(ReportTicks, WidenASingleValue) {
  double low = 3, high = 3;
  widen(low, high);
  EXPECT_LT(low, 3);
  EXPECT_GT(high, 3);
  low = high = 0;
  widen(low, high);
  EXPECT_LT(low, high);
}

TEST(ReportTicksProperty, InsideTheLimitsAscendingAndFewEnough) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> exponent(-9, 9), unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const double scale = std::pow(10.0, exponent(random));
    double low = scale * unit(random), high = scale * unit(random);
    if (low > high) std::swap(low, high);
    if (high - low < 1e-6 * scale) continue;
    const int most = 2 + i % 9;
    const Ticks t = linear_ticks(low, high, most);
    ASSERT_LE(t.major.size(), static_cast<std::size_t>(std::max(most, 4))) << low << " " << high;
    ASSERT_GE(t.major.size(), static_cast<std::size_t>(most >= 3 ? 2 : 0)) << low << " " << high << " " << most;
    ASSERT_EQ(t.major.size(), t.labels.size());
    for (std::size_t k = 0; k < t.major.size(); ++k) {
      ASSERT_GE(t.major[k], low - 1e-9 * scale);
      ASSERT_LE(t.major[k], high + 1e-9 * scale);
      if (k > 0) {
        ASSERT_GT(t.major[k], t.major[k - 1]);
        ASSERT_NE(t.labels[k], t.labels[k - 1]) << low << " " << high;
      }
    }
  }
}

TEST(Ticks, DegreesShowMoreThanOneMarkWhereTheyFit) {
  EXPECT_EQ(degree_ticks(-310, -75, 3).labels, (std::vector<std::string>{"−270", "−180", "−90"}));
  EXPECT_EQ(degree_ticks(-180, 180, 5).major, (std::vector<double>{-180, -90, 0, 90, 180}));
  EXPECT_LE(degree_ticks(-2000, 2000, 3).major.size(), 3U);
}

}  // namespace
}  // namespace whirl::report
