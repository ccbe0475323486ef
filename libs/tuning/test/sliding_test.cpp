#include "whirl/tuning/sliding.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "rig_design.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {
namespace {

ControllerDesign sliding_on_rig(const rig::RigParameters& rig, const char* law, double rho, double eps) {
  DesignOptions o;
  o.law = law;
  o.hardware = data_sheet(rig);
  o.fixed = {{"switching_gain", rho}, {"boundary_layer", eps}};
  return untuned_design(true_model(rig), o);
}

/// S of both axes from s0 under a sinusoidal disturbance, integrated in small steps.
Recording surface(double s0, double rho, double eps, double disturbance) {
  constexpr int kTicks = 4000, kParts = 200;
  constexpr double kTick = 1e-3;
  Eigen::VectorXd x(kTicks), y(kTicks);
  double s[2] = {s0, -0.5 * s0};
  for (int k = 0; k < kTicks; ++k) {
    x[k] = s[0], y[k] = s[1];
    for (int i = 0; i < kParts; ++i) {
      const double t = (k + static_cast<double>(i) / kParts) * kTick;
      s[0] += kTick / kParts * (disturbance * std::sin(20 * t) - rho * std::tanh(s[0] / eps));
      s[1] += kTick / kParts * (disturbance * std::cos(20 * t) - rho * std::tanh(s[1] / eps));
    }
  }
  Recording log;
  log.dt = kTick;
  log.add("s_x", Quantity::velocity, x);
  log.add("s_y", Quantity::velocity, y);
  return log;
}

// A disturbance below the switching gain: the argument holds, and the surface is reached within its bound. One above
// it: the finding says by how much and for how long.
TEST(SlidingProperty, TheBoundHoldsExactlyWhereTheSwitchingGainIsAboveTheDisturbance) {
  const ControllerDesign d = sliding_on_rig({}, "tsmc", 3, 0.05);
  const SlidingStudy below = sliding_study(d, surface(0.8, 3, 0.05, 2)).value();
  EXPECT_NEAR(below.largest_disturbance, 2, 0.02);
  EXPECT_EQ(below.share_above, 0);
  EXPECT_EQ(below.share_outside, 0);
  EXPECT_FALSE(below.missed());
  EXPECT_NEAR(below.layer, 0.05 * std::atanh(2.5 / 3), 0.002);
  EXPECT_GT(below.reached, 0.1);
  EXPECT_LE(below.reached, below.reach_bound);
  EXPECT_NEAR(below.reach_bound, 1.6, 0.05);
  for (std::size_t k = 0; k < below.v.size(); k += 50)
    EXPECT_NEAR(below.v[k], 0.5 * (std::pow(below.s[0][k], 2) + std::pow(below.s[1][k], 2)), 1e-15);

  const SlidingStudy above = sliding_study(d, surface(0.8, 3, 0.05, 4)).value();
  ASSERT_TRUE(above.missed());
  EXPECT_EQ(above.missed()->code, FindingCode::sliding_bound_missed);
  EXPECT_NEAR(above.missed()->amount("disturbance"), 4, 0.05);
  EXPECT_GT(above.share_above, 0.3);
  EXPECT_FALSE(std::isfinite(above.reach_bound));
}

// S is read once a tick: a surface that is reached between two ticks is seen at the later one.
TEST(Sliding, TheTimeToReachIsMetToTheTick) {
  SlidingStudy study;
  study.time = {0, 0.001, 0.002};
  study.reach_bound = 0.0595;
  study.reached = 0.06;
  EXPECT_TRUE(study.reached_in_time());
  study.reached = 0.061;
  EXPECT_FALSE(study.reached_in_time());
}

// On the rig: a gain far above what the model has wrong holds, the same law with a fiftieth of it does not.
TEST(SlidingE2e, RunsTellWhetherTheReachingConditionHolds) {
  const rig::RigParameters rig;
  for (const auto& [rho, holds] : {std::pair{20.0, true}, {0.4, false}}) {
    ControllerDesign d = sliding_on_rig(rig, "tsmc", rho, rho / 40);
    d.parameters["supervise"] = 0;
    const SlidingStudy study = sliding_study(d, run_closed_loop(d, rig).log).value();
    std::printf("rho %.1f: disturbance %.3g m/s^2, above for %.2f %%, reached %.3g s of %.3g s\n", rho,
                study.largest_disturbance, 100 * study.share_above, study.reached, study.reach_bound);
    EXPECT_EQ(!study.missed(), holds) << rho;
    if (holds) {
      EXPECT_LT(study.share_outside, 0.001);
      EXPECT_TRUE(study.reached_in_time());
    }
  }
}

// A surface with a power of the velocity, and laws without a switching gain, have no such argument.
TEST(SlidingUnit, OtherLawsHaveNone) {
  const Recording log = surface(0.1, 3, 0.05, 1);
  EXPECT_TRUE(sliding_study(sliding_on_rig({}, "lsmc", 3, 0.05), log));
  EXPECT_FALSE(sliding_study(sliding_on_rig({}, "ntsmc", 3, 0.05), log));
  IdentifiedModel model;
  model.rotor = rig::RigParameters{}.true_model();
  DesignOptions o;
  o.law = "pd";
  o.hardware = data_sheet({});
  EXPECT_FALSE(sliding_study(untuned_design(model, o), log));
}

}  // namespace
}  // namespace whirl::tuning
