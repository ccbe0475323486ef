#include <gtest/gtest.h>

#include <cstdio>

#include "rig_design.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::tuning {
namespace {

ControllerDesign told(const rig::RigParameters& truth, const rig::RigParameters& sheet) {
  DesignOptions o = options_of(data_sheet(sheet));
  o.fixed = {{"kd", 400}};
  ControllerDesign d = untuned_design(true_model(truth), o);
  d.parameters["supervise"] = 0;
  return d;
}

// A sensor that is slow: its low-pass is part of the age of a reading and of the loop delay, in design, plant and
// controller. A design that is not told of it leaves more vibration.
TEST(SensorSheetE2e, TheLowPassOfTheSensorIsPartOfTheLoopDelay) {
  rig::RigParameters slow;
  slow.laser.bandwidth = 40, slow.laser.hysteresis = 2e-6;
  slow.laser.runout_1x = slow.laser.runout_2x = slow.laser.runout_3x = 0;
  rig::RigParameters quick = slow;
  quick.laser.bandwidth = 0;
  EXPECT_EQ(data_sheet(slow).laser.bandwidth, 40);
  EXPECT_EQ(data_sheet(slow).laser.hysteresis, 2e-6);
  const double lag = 1 / (2 * 3.14159265358979 * 40);
  EXPECT_NEAR(data_sheet(slow).loop_delay() - data_sheet(quick).loop_delay(), lag, 1e-12);
  const ControllerDesign knows = told(slow, slow), does_not = told(slow, quick);
  EXPECT_NEAR(knows.parameters.at("sensor_delay") - does_not.parameters.at("sensor_delay"), lag, 1e-12);

  const ClosedLoopMetrics with = run_closed_loop(knows, slow).metrics,
                          without = run_closed_loop(does_not, slow).metrics;
  std::printf("low-pass of 40 Hz: told %.4g mm, not told %.4g mm of %.4g mm\n", 1e3 * with.closed.all,
              1e3 * without.closed.all, 1e3 * with.open.all);
  EXPECT_TRUE(with.stable) << with.verdict.text();
  EXPECT_GT(without.closed.all, 1.5 * with.closed.all);
}

}  // namespace
}  // namespace whirl::tuning
