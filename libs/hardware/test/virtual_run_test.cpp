#include "whirl/hardware/virtual_run.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "whirl/testing/designs.hpp"

namespace whirl::hardware {
namespace {

std::atomic<long> ticks{0}, stall_at{-1};

// Asked by the loop's thread before every tick: the place to stop the loop for a while.
bool stall_once() noexcept {
  const long tick = ticks++;
  if (tick == stall_at) std::this_thread::sleep_for(std::chrono::milliseconds(250));
  return tick >= 400;
}

// A computer that stands still for a quarter of a second makes the virtual machine late: no tick is left out, the loop
// has no reason to trip, and not a force of the run differs.
TEST(VirtualRunRealtime, ALateComputerNeitherTripsTheLoopNorChangesIt) {
  const ControllerDesign design = testing::design_of("pd", "lpf");
  const rig::RigParameters rig;
  const auto run = [&](long at) {
    stall_at = at;
    ticks = 0;
    std::vector<rt::LoopSample> samples;
    VirtualRunOptions options;
    options.stop = stall_once;
    options.take = [&](const rt::LoopSample& s) { samples.push_back(s); };
    const VirtualRun done = run_virtual(design, rig, options);
    if (at >= 0) {
      EXPECT_GT(done.timing.missed, 100);
    }
    return samples;
  };
  const auto smooth = run(-1), stalled = run(200);
  ASSERT_EQ(smooth.size(), 400U);
  ASSERT_EQ(stalled.size(), 400U);
  for (std::size_t k = 0; k < stalled.size(); ++k) {
    ASSERT_EQ(stalled[k].trip, 0) << k;
    ASSERT_EQ(stalled[k].tick, smooth[k].tick);
    ASSERT_EQ(stalled[k].ux, smooth[k].ux) << k;
    ASSERT_EQ(stalled[k].x, smooth[k].x) << k;
  }
}

}  // namespace
}  // namespace whirl::hardware
