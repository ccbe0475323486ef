#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/diagnosis/standards.hpp"

// Limits at the limit itself, and every row of the tables.
namespace whirl::diagnosis {
namespace {

TEST(ZoneLimitsReference, HousingsAsQuotedFromIso20816Part3) {
  const struct {
    const char* word;
    int group;
    bool flexible;
    double a, b, c;  // mm/s
  } rows[] = {{"1-rigid", 1, false, 2.3, 4.5, 7.1},
              {"1-flexible", 1, true, 3.5, 7.1, 11},
              {"2-rigid", 2, false, 1.4, 2.8, 4.5},
              {"2-flexible", 2, true, 2.3, 4.5, 7.1}};
  for (const auto& row : rows) {
    const auto machine = machine_class(row.word);
    ASSERT_TRUE(machine) << row.word;
    EXPECT_EQ(machine->group, row.group);
    EXPECT_EQ(machine->flexible, row.flexible);
    EXPECT_EQ(to_string(*machine), row.word);
    EXPECT_DOUBLE_EQ(housing_vibration_limit('A', *machine), 1e-3 * row.a);
    EXPECT_DOUBLE_EQ(housing_vibration_limit('B', *machine), 1e-3 * row.b);
    EXPECT_DOUBLE_EQ(housing_vibration_limit('C', *machine), 1e-3 * row.c);
    for (const char zone : {'A', 'B', 'C'}) {
      const double limit = housing_vibration_limit(zone, *machine);
      EXPECT_EQ(housing_vibration_zone(limit, *machine), zone) << "the limit belongs to its zone";
      EXPECT_EQ(housing_vibration_zone(std::nextafter(limit, 1), *machine), zone + 1);
    }
    EXPECT_THROW(housing_vibration_limit('D', *machine), Error);
    EXPECT_THROW(housing_vibration_limit('@', *machine), Error);
  }
  EXPECT_FALSE(machine_class("3-rigid"));
  EXPECT_THROW(to_string(MachineClass{3, false}), Error);
}

TEST(ZoneLimitsReference, ShaftsAtTheirLimitAndWithoutSpeed) {
  for (const char zone : {'A', 'B', 'C'}) {
    const double limit = shaft_vibration_limit(zone, 300);
    EXPECT_EQ(shaft_vibration_zone(limit, 300), zone);
    EXPECT_EQ(shaft_vibration_zone(1.0001 * limit, 300), zone + 1);
  }
  EXPECT_NEAR(shaft_vibration_limit('B', 100), 9000e-6 / std::sqrt(100 * 30 / std::numbers::pi), 1e-12);
  EXPECT_NEAR(shaft_vibration_limit('C', 100), 13200e-6 / std::sqrt(100 * 30 / std::numbers::pi), 1e-12);
  for (const double speed : {0.0, -300.0, std::nan("")}) EXPECT_THROW(shaft_vibration_limit('A', speed), Error);
}

TEST(ZoneLimitsReference, MarginsBeginAtAFactorOfTwoAndAHalf) {
  EXPECT_EQ(required_margin(2.4999, false), 0);
  EXPECT_NEAR(required_margin(2.5, true), 0, 1e-12);
  EXPECT_NEAR(required_margin(2.5, false), 0.1, 1e-12);
  EXPECT_EQ(balance_grade_class(6.3e-3), 6.3);
  EXPECT_EQ(balance_grade_class(6.4e-3), 16);
  EXPECT_TRUE(std::isinf(balance_grade_class(5)));
  EXPECT_DOUBLE_EQ(balance_grade(2e-6, 300), 6e-4);
}

/// A peak of half width 3 samples at sample `top` of `n`, in a sweep of 24 rad/s^2, one vector a turn.
signal::SynchronousCurve sweep(Eigen::Index n, Eigen::Index top, double first = 100, double rate = 24) {
  signal::SynchronousCurve curve{"x", Eigen::VectorXd(n), Eigen::VectorXcd(n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    curve.speed[k] = std::sqrt(first * first + 2 * rate * 2 * std::numbers::pi * static_cast<double>(k));
    curve.vector[k] = 1 / (1 + std::pow(static_cast<double>(k - top) / 3.0, 2));
  }
  return curve;
}

TEST(ZoneLimitsReference, AmplificationNearTheEndsOfARecordAndOfRunDowns) {
  for (const Eigen::Index top : {4, 30, 35}) {
    const auto a = amplification(sweep(40, top));
    ASSERT_TRUE(a) << top;
    EXPECT_NEAR(a->sweep_rate, 24, 1e-9) << top;
    EXPECT_DOUBLE_EQ(a->amplitude, 1);
    EXPECT_NEAR(a->factor, a->critical / (a->high - a->low), 1e-12);
    EXPECT_NEAR(a->sweep, 24 / (a->critical * a->critical), 1e-12);
  }
  const auto down = amplification(sweep(40, 20, 200, -24));
  ASSERT_TRUE(down);
  EXPECT_NEAR(down->sweep_rate, -24, 1e-9);
  EXPECT_GT(down->sweep, 0);
  EXPECT_LT(down->low, down->high);
  // Half power lies straight between the speeds around it, which are not evenly apart.
  signal::SynchronousCurve uneven;
  uneven.speed = Eigen::Vector4d(80, 90, 100, 130);
  uneven.vector = Eigen::Vector4cd(0.4, 0.5, 1, 0.2);
  const double half = std::sqrt(0.5);
  EXPECT_NEAR(amplification(uneven)->low, 100 - 10 * (1 - half) / 0.5, 1e-12);
  EXPECT_NEAR(amplification(uneven)->high, 100 + 30 * (1 - half) / 0.8, 1e-12);
  EXPECT_FALSE(amplification(sweep(40, 0))) << "no rise before it";
  EXPECT_FALSE(amplification(sweep(40, 39))) << "no fall after it";
  EXPECT_FALSE(amplification(sweep(2, 1)));
  EXPECT_TRUE(amplification(sweep(9, 4), 2));
  EXPECT_NEAR(amplification(sweep(40, 20), 2)->sweep_rate, 12, 1e-9) << "two turns a vector";
}

}  // namespace
}  // namespace whirl::diagnosis
