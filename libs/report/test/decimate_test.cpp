#include "whirl/report/decimate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(ReportDecimateProperty, EveryColumnKeepsItsExtremes) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const Index n = 15000;
  const int columns = 640;
  const VectorXd x = VectorXd::LinSpaced(n, 0, 15);
  VectorXd y(n);
  for (double& v : y) v = normal(random);
  y(7777) = 50;
  y(7780) = -60;
  const auto kept = decimate_columns(x, y, 0, 15, columns);
  EXPECT_LE(kept.size(), 4U * (columns + 2));
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  std::vector<double> low(columns + 1, 1e9), high(columns + 1, -1e9), low_kept = low, high_kept = high;
  const auto column = [&](Index i) { return static_cast<std::size_t>(std::floor(x(i) * columns / 15)); };
  for (Index i = 0; i < n; ++i) {
    low[column(i)] = std::min(low[column(i)], y(i));
    high[column(i)] = std::max(high[column(i)], y(i));
  }
  for (const Index i : kept) {
    low_kept[column(i)] = std::min(low_kept[column(i)], y(i));
    high_kept[column(i)] = std::max(high_kept[column(i)], y(i));
  }
  EXPECT_EQ(low, low_kept);
  EXPECT_EQ(high, high_kept);
}

TEST(ReportDecimate, GapStaysOneGap) {
  const VectorXd x = VectorXd::LinSpaced(1000, 0, 1);
  VectorXd y = VectorXd::Zero(1000);
  y.segment(300, 200).setConstant(NAN);
  const auto kept = decimate_columns(x, y, 0, 1, 10);
  const auto gaps = std::count_if(kept.begin(), kept.end(), [&](Index i) { return std::isnan(y(i)); });
  EXPECT_EQ(gaps, 1);
}

TEST(ReportDecimate, LineEntersAndLeavesTheRange) {
  const VectorXd x = VectorXd::LinSpaced(101, 0, 100);
  const auto kept = decimate_columns(x, x, 40.5, 60.5, 100);
  EXPECT_EQ(kept.front(), 40);
  EXPECT_EQ(kept.back(), 61);
}

TEST(ReportDecimate, MinMaxOfGroups) {
  VectorXd y(10);
  y << 1, 5, -2, 3, NAN, NAN, 7, 8, 9, 0;
  const Eigen::Matrix2Xd g = min_max(y, 5);
  EXPECT_EQ(g(0, 0), 1);
  EXPECT_EQ(g(1, 0), 5);
  EXPECT_EQ(g(0, 1), -2);
  EXPECT_TRUE(std::isnan(g(0, 2)) && std::isnan(g(1, 2)));
  EXPECT_EQ(g(1, 4), 9);
  EXPECT_EQ(min_max(y, 50).cols(), 10);
}

}  // namespace
}  // namespace whirl::report
