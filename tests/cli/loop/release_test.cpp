// A controller that stops at any instant of a run-down, with and without its sensors: what the fading force of the trip
// saves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "served.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl {
namespace {

constexpr double kRate = 1000;

rig::RigParameters run_down(double seconds) {
  rig::RigParameters rig;
  rig.profile.omega_start = 1200 * std::numbers::pi / 30;
  rig.profile.ramp_time = seconds;
  rig.profile.dwell_end = 0.2;
  return rig;
}

/// Largest |x| of the true disk centre after half a second, zero-to-peak.
double peak(const std::shared_ptr<const rig::RigTables>& tables, double stop, bool lasers_lost, double release) {
  rig::RigRun run;
  if (lasers_lost) run.faults.push_back({rig::RigFault::sensor_loss, stop, 1e9});
  rig::VirtualRig rig(tables, run);
  const rig::RigTruth truth(rig);
  control::Controller controller = control::make_controller(testing::pd_design());
  rt::SimulatedClock clock(1 / kRate);
  const rt::LoopOptions options{.sample_time = 1 / kRate, .release = std::lround(release * kRate)};
  rt::Loop loop(rig, controller, clock, rt::SafetyLimits{.stale = 20}, options);
  double out = 0;
  for (long k = 0; !rig.done(); ++k) {
    if (k > kRate / 2) out = std::max(out, std::abs(truth.z().real()));
    if (!lasers_lost && rig.time() >= stop) loop.stop();
    loop.cycle();
  }
  return out;
}

double open_peak(const std::shared_ptr<const rig::RigTables>& tables) { return peak(tables, 0, false, 0); }

TEST(ReleaseE2e, NeverAboveTheUncontrolledPeakWheneverTheLoopStops) {
  const auto tables = rig::make_rig_tables(run_down(3));
  const double open = open_peak(tables);
  double at_once = 0, fading = 0;
  for (double stop = 0.4; stop < 2.4; stop += 0.1) {
    for (const bool lost : {false, true}) {
      at_once = std::max(at_once, peak(tables, stop, lost, 0));
      fading = std::max(fading, peak(tables, stop, lost, 3));
    }
  }
  EXPECT_LT(fading, 0.95 * open);
  // What it is for: letting go at once is worse than no control at all.
  EXPECT_GT(at_once, 1.1 * open);
}

// In a run-down four times as slow the fading can end in the resonance.
TEST(ReleaseE2e, InASlowRunDownItStaysWithinOnePerCent) {
  const auto tables = rig::make_rig_tables(run_down(13));
  const double open = open_peak(tables);
  double at_once = 0, fading = 0;
  for (double stop = 0.7; stop < 6; stop += 0.6) {
    at_once = std::max(at_once, peak(tables, stop, true, 0));
    fading = std::max(fading, peak(tables, stop, true, 3));
  }
  EXPECT_LT(fading, 1.01 * open);
  EXPECT_GT(at_once, 1.04 * open);
}

}  // namespace
}  // namespace whirl
