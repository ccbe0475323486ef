#include <gtest/gtest.h>

#include <type_traits>

#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/testing/alloc_guard.hpp"

namespace whirl::rig {
namespace {

struct Damper {
  double gain;  // N s/m
  double x = 0, y = 0;
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    const Command c{-gain * (m.x - x) / 1e-3, -gain * (m.y - y) / 1e-3};
    x = m.x, y = m.y;
    return c;
  }
  void applied(const Command&) noexcept {}
};

TEST(VirtualRigRealtime, ClosedLoopAllocatesNothingAndDamps) {
  static_assert(noexcept(std::declval<VirtualRig&>().advance())&& noexcept(std::declval<VirtualRig&>().read()));
  RigRun run;
  run.faults = {{RigFault::sensor_stuck, 1, 1.01}, {RigFault::extra_delay, 2, 2.1, RigAxis::both, 1}};
  VirtualRig rig(RigParameters{}, run);
  Damper damper{.gain = 40};
  rt::SimulatedClock clock(1e-3);
  rt::SafetyLimits limits;
  limits.force = 40;
  limits.displacement = 10e-3;
  double peak = 0;
  {
    rt::Loop loop(rig, damper, clock, limits);
    const RigTruth truth(rig);
    testing::AllocationGuard guard;
    while (!rig.done()) {
      loop.cycle();
      if (rig.tick() > 500) peak = std::max(peak, std::abs(truth.z().real()));
    }
    EXPECT_EQ(guard.count(), 0u);
    EXPECT_EQ(loop.safety().trip, Fault::none);
  }
  EXPECT_LT(peak, 1e-3);  // open loop 6.45 mm
  testing::AllocationGuard control;
  testing::allocate_twice();
  EXPECT_EQ(control.count(), 2u);
}

}  // namespace
}  // namespace whirl::rig
