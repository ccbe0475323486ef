#include "whirl/diagnosis/balancing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

TEST(BalancingReference, ScrewOppositeTheHeavySpot) {
  // 5 g at 83 mm on 1.5 kg: 276.7 um; the advice is the same screw on the other side.
  RotorModel m;
  m.eps = std::polar(5e-3 * 83e-3 / 1.5, 0.7);
  const BalancingAdvice a = balancing_advice(m, 1.5, 83e-3, 188);
  EXPECT_NEAR(a.correction_mass, 5e-3, 1e-12);
  EXPECT_NEAR(a.correction_angle, 0.7 - std::numbers::pi, 1e-12);
  EXPECT_NEAR(a.grade, 276.67e-3 * 188, 0.01);  // G 52
  EXPECT_FALSE(a.within_grade);
  // ISO 21940-11: e_per = G / omega, at 188 rad/s and G 6.3: 33.5 um.
  EXPECT_NEAR(a.permitted_unbalance / 1.5, 33.5e-6, 0.1e-6);
  m.eps = 0.5e-3;
  EXPECT_TRUE(balancing_advice(m, 1.5, 83e-3, 2, 1).within_grade) << "at the limit itself";
  EXPECT_FALSE(balancing_advice(m, 1.5, 83e-3, 2, 0.999).within_grade);
  EXPECT_THROW(balancing_advice(m, 0, 1, 1), Error);
}

std::vector<double> covariance(double re, double cross, double im) {
  std::vector<double> c(25, 0);
  c[18] = re, c[24] = im, c[19] = c[23] = cross;
  return c;
}

// A well known eccentricity: value +- 1.96 sd along and across it.
TEST(BalancingProperty, IntervalsOfAKnownEccentricityAreItsDeviations) {
  RotorModel m;
  m.eps = std::polar(1e-4, 0.3);
  const double c = std::cos(0.3), s = std::sin(0.3), along = 1e-12, across = 4e-12;
  const BalancingAdvice a = balancing_advice(
      m, 2, 0.1, 100, 6.3,
      covariance(along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c));
  EXPECT_NEAR(a.mass_interval->high - a.mass_interval->low, 2 * 1.96 * 2e-6 / 0.1, 0.02e-5);
  EXPECT_NEAR(a.angle_interval->high - a.angle_interval->low, 2 * 1.96 * 0.02, 2e-3);
}

// Two readings further apart than the eccentricity is large: the other one lies inside, and where zero does, no angle
// is excluded.
TEST(BalancingProperty, ReadingsFarApartAreBothInside) {
  RotorModel m;
  m.eps = {1e-4, 0};
  // The other reading at (1e-4, 1.5e-4).
  const BalancingAdvice a = balancing_advice(m, 1, 0.1, 100, 6.3, covariance(1e-14, 0, std::pow(1.6e-4 / 1.96, 2)));
  EXPECT_TRUE(a.mass_interval->covers(std::hypot(1e-4, 1.5e-4) / 0.1));
  EXPECT_TRUE(a.angle_interval->covers(a.correction_angle + std::atan2(1.5, 1)));
  EXPECT_GT(a.mass_interval->low, 0.9e-4 / 0.1);
  const BalancingAdvice around =
      balancing_advice(m, 1, 0.1, 100, 6.3, covariance(std::pow(1.5e-4 / 1.96, 2), 0, 1e-12));
  EXPECT_EQ(around.mass_interval->low, 0);
  EXPECT_NEAR(around.angle_interval->high - around.angle_interval->low, 2 * std::numbers::pi, 1e-9);
}

}  // namespace
}  // namespace whirl::diagnosis
