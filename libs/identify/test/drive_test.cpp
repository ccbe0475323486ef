#include "whirl/identify/drive.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/testing/driven_rotor.hpp"

namespace whirl::identification {
namespace {

constexpr double kDt = 1e-3;

/// A run-up at full drive, then the motor off.
Eigen::VectorXd up_and_down(Eigen::Index samples, double level) {
  Eigen::VectorXd u = Eigen::VectorXd::Constant(samples, level);
  u.tail(samples * 2 / 5).setZero();
  return u;
}

class DriveProperty : public ::testing::Test {
 protected:
  static const IdentifiedModel& model() {
    static const IdentifiedModel found = [] {
      const testing::DrivenRotor rotor;
      DriveOptions o;
      o.inertia = rotor.inertia;
      return identify_drive({testing::driven_record(rotor, up_and_down(9000, 1), kDt, 0, std::pow(10, -1.5), 21)}, o);
    }();
    return found;
  }
};

// Torque constants within 2 % from one run-up and coast-down at 30 dB.
TEST_F(DriveProperty, TorqueConstantsWithinTwoPercent) {
  const testing::DrivenRotor truth;
  ASSERT_NE(model().summary.status, Status::unusable) << model().summary.warnings.back();
  const std::pair<const char*, double> expected[] = {
      {"C_m1", truth.motor},      {"C_m2", truth.slope},    {"C_c", truth.coulomb},
      {"C_v", truth.viscous},     {"C_a", truth.drag},      {"mass_per_inertia", truth.m / truth.inertia},
      {"k1", truth.k1 / truth.m}, {"c", truth.c / truth.m}, {"e", truth.e}};
  for (const auto& [name, value] : expected) {
    const Estimate* e = model().parameter(name);
    ASSERT_NE(e, nullptr) << name;
    EXPECT_NEAR(e->value, value, 0.02 * value) << name;
    EXPECT_LT(std::abs(e->value - value), 5 * e->sd) << name;
  }
}

// The drive below which a run-up stalls at the critical speed, against the generator's own.
TEST_F(DriveProperty, StallIsPredictedWithinOnePercent) {
  const testing::DrivenRotor truth;
  const double critical = std::sqrt(truth.k1 / truth.m), seconds = 12, beyond = 1.5 * critical;
  double low = 0.05, high = 1;
  while (high - low > 5e-4 * high) {
    const double middle = 0.5 * (low + high);
    double top = 0;
    testing::driven_record(truth, Eigen::VectorXd::Constant(static_cast<Eigen::Index>(seconds / kDt), middle), kDt, 0,
                           0, 1, &top);
    (top >= beyond ? high : low) = middle;
  }
  const double expected = 0.5 * (low + high);
  EXPECT_NEAR(limiting_drive(model(), beyond, seconds, 2000, 2), expected, 0.01 * expected);
  // Below it the rotor hangs under the critical speed for good: that is what the shaking takes.
  const RunUp stalled = run_up(model(), 0.97 * expected, seconds, 2000);
  EXPECT_LT(stalled.reached, beyond);
  EXPECT_GT(run_up(model(), 1.03 * expected, 2 * seconds, 2000).reached, beyond);
}

TEST_F(DriveProperty, FreeRunOfAllSixStatesFollowsAnotherDrive) {
  const testing::DrivenRotor truth;
  const Recording other = testing::driven_record(truth, up_and_down(6000, 0.8), kDt, 0, 0, 5);
  const Recording run = simulate_drive(model(), other);
  const Eigen::VectorXd& beta = other["beta"];
  EXPECT_LT((run["beta"] - beta).cwiseAbs().maxCoeff(), 0.01 * beta.maxCoeff());
}

TEST_F(DriveProperty, AnAngleThatComesBackEveryTurnIsValidatedAsTheStraightOne) {
  const testing::DrivenRotor truth;
  Recording other = testing::driven_record(truth, up_and_down(6000, 0.8), kDt, 0, 0, 5);
  const ValidationRun straight = validate(model(), std::vector{other}).runs[0];
  for (Channel& c : other.channels)
    if (c.name == "beta") c.samples = c.samples.unaryExpr([](double b) { return std::fmod(b, 2 * std::numbers::pi); });
  const ValidationRun wrapped = validate(model(), std::vector{other}).runs[0];
  EXPECT_NE(wrapped.summary.status, Status::unusable);
  EXPECT_NEAR(wrapped.general.scores.back().rmse, straight.general.scores.back().rmse, 1e-6);
}

TEST(Drive, WhatARecordCannotTellIsJoinedAndSaid) {
  const testing::DrivenRotor truth;
  const Recording up = testing::driven_record(truth, Eigen::VectorXd::Ones(5000), kDt, 0, std::pow(10, -1.5), 3);
  const IdentifiedModel model = identify_drive({up});
  EXPECT_EQ(model.parameter("motor_slope"), nullptr);
  EXPECT_EQ(model.parameter("coulomb"), nullptr);
  ASSERT_NE(model.parameter("motor"), nullptr);
  EXPECT_NEAR(model.parameter("motor")->value, (truth.motor - truth.coulomb) / truth.inertia,
              0.02 * truth.motor / truth.inertia);
  ASSERT_FALSE(model.summary.warnings.empty());
  EXPECT_NE(model.summary.warnings.front().find("never off"), std::string::npos);
  EXPECT_THROW(run_up(IdentifiedModel{}, 1, 1, 1000), Error);
}

}  // namespace
}  // namespace whirl::identification
