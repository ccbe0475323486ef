#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "whirl/diagnosis/balancing.hpp"

namespace whirl::diagnosis {
namespace {

constexpr double k95 = 1.959963984540054;

/// Covariance of an eccentricity with these deviations along and across the direction `angle`.
std::vector<double> covariance_of(double along, double across, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), p = along * along, q = across * across;
  std::vector<double> out(25, 0);
  out[18] = c * c * p + s * s * q;
  out[19] = out[23] = c * s * (p - q);
  out[24] = s * s * p + c * c * q;
  return out;
}

BalancingAdvice advice(double size, double angle, const std::vector<double>& covariance) {
  RotorModel m;
  m.eps = std::polar(size, angle);
  return balancing_advice(m, 2, 0.1, 300, 6.3, covariance);
}

// Mass 2 kg at 0.1 m: a correction of 20 times the eccentricity.
TEST(AdviceIntervals, AnEllipseAlongTheEccentricityBoundsTheMassAndAcrossItTheAngle) {
  for (const double angle : {0.0, 0.5, 2.0, -1.2, 3.1}) {
    const BalancingAdvice along = advice(1e-4, angle, covariance_of(1e-5, 1e-9, angle));
    EXPECT_NEAR(along.mass_interval->low, 20 * (1e-4 - k95 * 1e-5), 1e-8) << angle;
    EXPECT_NEAR(along.mass_interval->high, 20 * (1e-4 + k95 * 1e-5), 1e-8) << angle;
    EXPECT_NEAR(along.mass_interval->sd, 20 * 1e-5, 1e-8);
    EXPECT_NEAR(along.angle_interval->high - along.angle_interval->low, 0, 1e-3);
    const BalancingAdvice across = advice(1e-4, angle, covariance_of(1e-9, 1e-5, angle));
    EXPECT_NEAR(across.mass_interval->low, 20 * 1e-4, 1e-7) << angle;
    EXPECT_NEAR(across.angle_interval->high - across.angle_interval->value, std::atan(k95 * 0.1), 1e-4);
    EXPECT_NEAR(across.angle_interval->value - across.angle_interval->low, std::atan(k95 * 0.1), 1e-4);
    EXPECT_NEAR(across.angle_interval->sd, std::atan(k95 * 0.1) / k95, 1e-4);
    EXPECT_NEAR(std::abs(std::polar(1.0, across.angle_interval->value) + std::polar(1.0, angle)), 0, 1e-12)
        << "opposite to the heavy side";
  }
}

// 2.2 standard deviations: zero lies outside of the ellipse of 1.96, and yet is no rare truth of such a size.
TEST(AdviceIntervals, ASizeThatNoiseAloneMakesInTwentyIsNotDifferentFromZero) {
  const BalancingAdvice a = advice(2.2e-5, 0.4, covariance_of(1e-5, 1e-5, 0.4));
  EXPECT_EQ(a.mass_interval->low, 0);
  EXPECT_GT(a.mass_interval->high, 20 * 4.1e-5);
  EXPECT_NEAR(a.angle_interval->high - a.angle_interval->low, 2 * M_PI, 1e-9);
  EXPECT_GT(advice(2.8e-5, 0.4, covariance_of(1e-5, 1e-5, 0.4)).mass_interval->low, 0);
}

TEST(AdviceIntervals, WhereZeroLiesInTheEllipseAnyAngleMayBeRight) {
  const double angle = 0.9, any = 2 * M_PI;
  const auto width = [&](double along, double across) {
    const BalancingAdvice a = advice(1e-4, angle, covariance_of(along, across, angle));
    EXPECT_EQ(a.mass_interval->low == 0, a.angle_interval->high - a.angle_interval->low > 6);
    return a.angle_interval->high - a.angle_interval->low;
  };
  EXPECT_NEAR(width(1.01e-4 / k95, 1e-6), any, 1e-9);
  EXPECT_LT(width(0.99e-4 / k95, 1e-6), 3) << "zero lies just before its end";
  EXPECT_LT(width(0.5e-4 / k95, 9e-4), 3.2) << "long across, but short along";
  EXPECT_NEAR(width(2e-4, 2e-4), any, 1e-9);
  // Zero beside the ellipse, but within its length.
  EXPECT_LT(
      [&] {
        const BalancingAdvice a = advice(1e-4, angle, covariance_of(1e-4, 1e-6, angle + 0.5));
        return a.angle_interval->high - a.angle_interval->low;
      }(),
      3.2);
}

}  // namespace
}  // namespace whirl::diagnosis
