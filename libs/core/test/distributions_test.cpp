#include "whirl/core/distributions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace whirl {
namespace {

TEST(DistributionsReference, TailsAreThoseOfTheirClosedForms) {
  for (const double x : {0.0, 0.3, 1.0, 4.0, 30.0}) {
    EXPECT_NEAR(chi_squared_tail(2, x), std::exp(-x / 2), 1e-15);
    EXPECT_NEAR(chi_squared_tail(4, x), std::exp(-x / 2) * (1 + x / 2), 1e-15);
    EXPECT_NEAR(students_t_tail(1, x), 0.5 - std::atan(x) / std::numbers::pi, 1e-15);
    for (const double below : {1.0, 7.5, 40.0})
      EXPECT_NEAR(fisher_f_tail(2, below, x), std::pow(1 + 2 * x / below, -below / 2), 1e-14);
  }
}

TEST(DistributionsReference, QuantilesAreThoseOfTables) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963985, 1e-9);
  EXPECT_NEAR(students_t_quantile(5, 0.975), 2.570582, 1e-6);
  EXPECT_NEAR(fisher_f_quantile(2, 10, 0.95), 4.102821, 1e-6);
}

TEST(DistributionsReference, BoundsOfAProportionAreThoseOfClopperAndPearson) {
  EXPECT_NEAR(proportion_lower_bound(10, 5, 0.025), 0.1870860, 1e-6);
  EXPECT_NEAR(proportion_upper_bound(10, 5, 0.025), 0.8129140, 1e-6);
  EXPECT_NEAR(proportion_upper_bound(20, 0, 0.025), 1 - std::pow(0.025, 1 / 20.0), 1e-12);
}

TEST(DistributionsProperty, AQuantileIsTheInverseOfItsTail) {
  for (const double p : {0.01, 0.4, 0.95, 0.999}) {
    EXPECT_NEAR(1 - students_t_tail(3.5, students_t_quantile(3.5, p)), p, 1e-12);
    EXPECT_NEAR(1 - fisher_f_tail(3, 8.5, fisher_f_quantile(3, 8.5, p)), p, 1e-12);
  }
}

TEST(Distributions, ValuesOutsideTheirDomainAreRefused) {
  EXPECT_THROW(students_t_quantile(0, 0.5), std::domain_error);
  EXPECT_THROW(chi_squared_tail(-1, 1), std::domain_error);
  EXPECT_THROW(chi_squared_tail(1, -1), std::domain_error);
  EXPECT_THROW(normal_quantile(1.5), std::domain_error);
}

}  // namespace
}  // namespace whirl
