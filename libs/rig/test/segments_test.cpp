#include "whirl/rig/segments.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace whirl::rig {
namespace {

TEST(Segments, FollowTheSpeedRatioInBothDirections) {
  Eigen::VectorXd omega(5);
  omega << 25, 20, 10, 5, 0;
  EXPECT_EQ(segments(omega, 10), (std::vector<int>{0, 1, 2, 3, 3}));
  EXPECT_EQ(segments(-omega.reverse(), 10), (std::vector<int>{3, 3, 2, 1, 0}));
}

TEST(Segments, PeaksSkipTheStartTransient) {
  Eigen::VectorXd x(6);
  x << 9, -2, 3, -4, 1, 0.5;
  const SegmentPeaks p = segment_peaks(x, {0, 0, 1, 2, 2, 3}, 1);
  EXPECT_EQ(p.segment, (std::array<double, 4>{2, 3, 4, 0.5}));
  EXPECT_EQ(p.all, 4);
}

TEST(Segments, DivergenceStaysVisible) {
  Eigen::VectorXd x(3);
  x << 1, std::nan(""), 2;
  EXPECT_FALSE(segment_peaks(x, {0, 1, 2}, 0).all < 1e9);
}

TEST(SegmentsReference, SuppressionOfTable4) {
  // Paper Table 4: open and controlled peaks, mm; printed 61, 91, 96, 81.8, 92.7 %.
  const SegmentPeaks s = suppression({{0.41, 2.25, 6.45, 2.59}, 6.45}, {{0.16, 0.20, 0.26, 0.47}, 0.47});
  EXPECT_NEAR(s.segment[0], 0.610, 0.001);
  EXPECT_NEAR(s.segment[1], 0.911, 0.001);
  EXPECT_NEAR(s.segment[2], 0.960, 0.001);
  EXPECT_NEAR(s.segment[3], 0.819, 0.001);
  EXPECT_NEAR(s.all, 0.927, 0.001);
}

}  // namespace
}  // namespace whirl::rig
