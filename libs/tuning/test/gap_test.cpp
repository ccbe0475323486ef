#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::tuning {
namespace {

/// A disk in steady whirl of 0.2 mm at 60 rad/s, whatever the force: what the sensors show does not depend on what the
/// controller makes of it, so that only its own error after a gap is seen.
struct SteadyWhirl {
  double k = 0;
  Measurement read() const noexcept {
    const double t = 1e-3 * k, b = 60 * t;
    return {.t = t, .x = 2e-4 * std::cos(b - 1), .y = 2e-4 * std::sin(b - 1), .beta = b, .omega = 60};
  }
  void write(const Command&) const noexcept {}
  void advance() noexcept { k += 1; }
};
struct SkippedTicks {
  SteadyWhirl& rig;
  long gap = 0;
  long wait() noexcept {
    rig.k += static_cast<double>(gap);
    return std::exchange(gap, 0);
  }
};

TEST(GapRealtime, ForceAfterAGapStaysNearTheSteadyOneForEveryEstimatorAndPolicy) {
  double worst = 0;
  for (const auto& estimator : control::estimators()) {
    for (const rt::DtPolicy policy : {rt::DtPolicy::nominal, rt::DtPolicy::fill}) {
      for (const long gap : {1L, 2L, 3L, 5L, 10L, 20L, 30L, 45L}) {
        ControllerDesign design = testing::design_of("tsmc", estimator.name);
        control::Controller controller = control::make_controller(design);
        SteadyWhirl rig;
        SkippedTicks clock{rig};
        rt::Loop loop(rig, controller, clock, {}, {.dt = policy});
        double steady = 0, after = 0;
        for (int k = 0; k < 1500; ++k) {
          const Command u = loop.cycle().sent;
          if (k > 1000) steady = std::max({steady, std::abs(u.ux), std::abs(u.uy)});
        }
        clock.gap = gap;
        for (int k = 0; k < 300; ++k) {
          const rt::CycleRecord r = loop.cycle();
          EXPECT_EQ(r.trip, Fault::none);
          after = std::max({after, std::abs(r.sent.ux), std::abs(r.sent.uy)});
        }
        ASSERT_GT(steady, 0.1) << estimator.name;
        worst = std::max(worst, after / steady);
        EXPECT_LE(after, 1.3 * steady) << estimator.name << ", gap " << gap
                                       << (policy == rt::DtPolicy::fill ? ", fill" : ", nominal") << ", steady "
                                       << steady << " N";
      }
    }
  }
  RecordProperty("worst_ratio", std::to_string(worst));
  std::printf("largest force after a gap: %.3f of the steady one\n", worst);
}

}  // namespace
}  // namespace whirl::tuning
