#include "whirl/core/magnitude.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace whirl {
namespace {

TEST(Magnitude, FarFromZeroItIsThatOfANormalNumber) {
  const Estimate e = magnitude_estimate(10, 1), normal = Estimate::from_sd(10, 1);
  EXPECT_EQ(e.low, normal.low);
  EXPECT_EQ(e.high, normal.high);
  const Estimate near = magnitude_estimate(4.999, 1);
  EXPECT_NEAR(near.low, 4.999 - 1.96, 0.15);
  EXPECT_NEAR(near.high, 4.999 + 1.96, 0.15);
}

TEST(Magnitude, NearZeroItEndsThereAndNoLowerEndIsNegative) {
  EXPECT_EQ(magnitude_estimate(2.7, 1).low, 0);
  EXPECT_GT(magnitude_estimate(2.73, 1).low, 0);
  EXPECT_EQ(magnitude_estimate(0, 2).low, 0);
  EXPECT_DOUBLE_EQ(magnitude_estimate(0, 2).high, 2 * 1.959964);
  EXPECT_EQ(magnitude_estimate(0, 0).low, 0);
  EXPECT_TRUE(std::isnan(magnitude_estimate(1, NAN).low));
  EXPECT_EQ(magnitude_estimate(1, INFINITY).low, 0);
}

// Value +- 1.96 sd holds a true size of zero in 85 %, and cut off at zero it holds nothing more.
TEST(MagnitudeProperty, ItHoldsTheTrueSizeInNinetyFivePercent) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 800;
  for (const double truth : {0.0, 0.3, 1.0, 2.0, 3.0, 4.5, 6.0}) {
    int held = 0;
    for (int k = 0; k < kDraws; ++k)
      held += magnitude_estimate(std::hypot(truth + normal(random), normal(random)), 1).covers(truth);
    EXPECT_GE(held, 0.93 * kDraws) << truth;
    EXPECT_LE(held, (truth < 2 ? 1.0 : 0.985) * kDraws) << truth;
  }
}

}  // namespace
}  // namespace whirl
