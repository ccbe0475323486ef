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
  EXPECT_THROW(balancing_advice(m, 0, 1, 1), Error);
}

}  // namespace
}  // namespace whirl::diagnosis
