#include "rules/magnitudes.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace whirl::identification {
namespace {

// An unbalance of 1.5 standard deviations had an interval that began below zero, and an angle known to 40 degrees.
TEST(Magnitudes, ASizeIsNeverBelowZeroAndItsPhaseThenAnyOne) {
  IdentifiedModel m;
  m.parameters = {{"k1", Estimate::from_sd(1, 2)},
                  {"e", Estimate::from_sd(1.5e-5, 1e-5)},
                  {"e_phase", Estimate::from_sd(1, 0.7)},
                  {"bow", Estimate::from_sd(9e-5, 1e-5)},
                  {"bow_phase", Estimate::from_sd(2, 0.1)}};
  const Estimate bow = m.parameters[3].second;
  ASSERT_LT(m.parameters[1].second.low, 0);
  detail::keep_magnitudes(m);
  EXPECT_LT(m.parameters[0].second.low, 0) << "no size of a vector";
  EXPECT_EQ(m.parameters[1].second.low, 0);
  EXPECT_GE(m.parameters[1].second.high, 1.5e-5 + 1.9e-5);
  EXPECT_NEAR(m.parameters[2].second.high - m.parameters[2].second.low, 2 * M_PI, 1e-12);
  EXPECT_EQ(m.parameters[3].second.low, bow.low);
  EXPECT_EQ(m.parameters[3].second.high, bow.high);
  EXPECT_NEAR(m.parameters[4].second.high, 2 + 0.196, 1e-3);
}

}  // namespace
}  // namespace whirl::identification
