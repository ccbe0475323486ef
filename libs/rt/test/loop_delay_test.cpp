#include "whirl/rt/loop_delay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace {

constexpr double kDelayStep = 1e-3;

/// x'' = -w^2 x - 2 z w x' + b u(t - delay) in 200 steps per period, the reading of each row before its force.
Eigen::VectorXd respond(const Eigen::VectorXd& force, double delay, double hz, double zeta, double gain, double noise) {
  constexpr int kFine = 200;
  const double dt = kDelayStep / kFine, w = 2 * std::numbers::pi * hz;
  const long late = std::lround(delay / dt);
  std::mt19937_64 random(3);
  Eigen::VectorXd out(force.size());
  double x = 0, v = 0;
  for (long i = 0; i < force.size() * kFine; ++i) {
    if (i % kFine == 0) {
      double sum = -6;  // of twelve uniform numbers: nearly normal
      for (int k = 0; k < 12; ++k) sum += static_cast<double>(random() >> 11) * 0x1p-53;
      out(i / kFine) = x + noise * sum;
    }
    const double u = i >= late ? force((i - late) / kFine) : 0;
    v += dt * (-w * w * x - 2 * zeta * w * v + gain * u);
    x += dt * v;
  }
  return out;
}

struct Case {
  double delay, hz, zeta, gain;
};

TEST(LoopDelayProperty, FoundToATenthOfAPeriodUnderTheNoiseOfALaser) {
  for (const Case& c : {Case{2.37e-3, 12, 0.0066, 0.667}, Case{0.25e-3, 12, 0.02, -0.667}, Case{7.5e-3, 30, 0.05, 2},
                        Case{1.05e-3, 5, 0.3, 2}}) {
    SCOPED_TRACE(c.delay);
    const Eigen::VectorXd force = telegraph(0.2, 2000, 4);
    const LoopDelay d = loop_delay(force, respond(force, c.delay, c.hz, c.zeta, c.gain, 0.7e-6), kDelayStep);
    EXPECT_NEAR(d.delay, c.delay, 0.1 * kDelayStep);
    EXPECT_LT(std::abs(d.delay - c.delay), 5 * d.deviation + 0.02 * kDelayStep);
    EXPECT_NEAR(d.gain, c.gain, 0.03 * std::abs(c.gain));
    EXPECT_NEAR(d.frequency, c.hz, 0.05 * c.hz);
    EXPECT_GT(d.explained, 0.9);
  }
}

TEST(LoopDelayProperty, ExactWithoutNoise) {
  const Eigen::VectorXd force = telegraph(1, 1500, 9);
  EXPECT_NEAR(loop_delay(force, respond(force, 3.3e-3, 12, 0.01, 0.667, 0), kDelayStep).delay, 3.3e-3,
              0.01 * kDelayStep);
}

TEST(LoopDelay, WithoutAnActuatorNothingIsExplained) {
  const Eigen::VectorXd force = telegraph(0.2, 2000, 4);
  EXPECT_LT(loop_delay(force, respond(force, 1e-3, 12, 0.01, 0, 0.7e-6), kDelayStep).explained, 0.3);
}

TEST(LoopDelay, TheTelegraphHasOneAmplitudeAndTwoSigns) {
  const Eigen::VectorXd force = telegraph(0.3, 3000, 1);
  EXPECT_DOUBLE_EQ(force.cwiseAbs().minCoeff(), 0.3);
  EXPECT_DOUBLE_EQ(force.cwiseAbs().maxCoeff(), 0.3);
  EXPECT_LT(std::abs(force.mean()), 0.1);
  EXPECT_EQ(force, telegraph(0.3, 3000, 1));
  EXPECT_NE(force, telegraph(0.3, 3000, 2));
}

TEST(LoopDelay, ShortOrUnequalRecordsAreRefused) {
  EXPECT_THROW((void)loop_delay(Eigen::VectorXd::Ones(300), Eigen::VectorXd::Ones(300), kDelayStep), Error);
  EXPECT_THROW((void)loop_delay(Eigen::VectorXd::Ones(500), Eigen::VectorXd::Ones(501), kDelayStep), Error);
}

}  // namespace
}  // namespace whirl::rt
