#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/identify/identify.hpp"

namespace whirl::identification {
namespace {

/// An orbit of 2 mm about an offset, run down from 100 to 20 rad/s in 4 s.
Recording spiral() {
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(4001, 0, 4);
  const Eigen::ArrayXd beta = 100 * t - 10 * t.square();
  Recording r;
  r.dt = 1e-3;
  r.add("x", Quantity::displacement, (5e-3 + 2e-3 * beta.cos()).matrix());
  r.add("y", Quantity::displacement, (-1e-3 + 2e-3 * beta.sin()).matrix());
  r.add("beta", Quantity::angle, beta.matrix());
  return r;
}

TEST(DataRange, HoldsRadiusAndSpeedsAndNoSingleReadingCounts) {
  Recording r = spiral();
  r.channels[0].samples[1000] = 0.5;                                       // a spike
  r.channels[1].samples[2000] = std::numeric_limits<double>::quiet_NaN();  // a reading that is missing
  const DataRange range = data_range({r});
  EXPECT_NEAR(range.amplitude, 2e-3, 2e-4);
  EXPECT_NEAR(range.low, 20, 1);
  EXPECT_NEAR(range.high, 100, 1);
}

// What the check of records leaves out is no motion, however many samples in a row.
TEST(DataRange, ReadingsThatAreNoneDoNotCount) {
  for (const double value : {-9.999, 0.1}) {
    Recording r = spiral();
    r.channels[1].samples.segment(1500, 4).setConstant(value);
    EXPECT_NEAR(data_range({r}).amplitude, 2e-3, 2e-4) << value;
  }
}

TEST(DataRange, AnAngleThatComesBackEveryTurnHasTheSameSpeeds) {
  Recording r = spiral();
  for (double& beta : r.channels[2].samples) beta = std::fmod(beta, 2 * std::numbers::pi);
  const DataRange range = data_range({r}), straight = data_range({spiral()});
  EXPECT_NEAR(range.low, straight.low, 1e-9);
  EXPECT_NEAR(range.high, straight.high, 1e-9);
}

TEST(DataRange, NamesWhatLiesBeyond) {
  const DataRange range = data_range({spiral()});
  EXPECT_EQ(range.beyond(1.9e-3, 30, 90), "");
  EXPECT_NE(range.beyond(3e-3, 30, 90).find("radii above 2"), std::string::npos) << range.beyond(3e-3, 30, 90);
  EXPECT_EQ(range.beyond(3e-3, 30, 90).find("speeds"), std::string::npos);
  EXPECT_NE(range.beyond(1e-3, 90, 10).find("speeds outside 19"), std::string::npos) << range.beyond(1e-3, 90, 10);
}

// `whirl response` marks its points by `holds`, `whirl runup` and `simulate` ask `beyond`: one rule.
TEST(DataRange, BothQuestionsHaveOneRule) {
  const DataRange range{2e-3, 20, 100};
  for (const double omega : {18.9, 19.1, 60.0, 104.9, 105.1}) {
    for (const double radius : {1e-3, 2.1e-3})
      EXPECT_EQ(range.holds(radius, omega), range.beyond(radius, omega, 60).empty()) << omega << ' ' << radius;
  }
}

}  // namespace
}  // namespace whirl::identification
