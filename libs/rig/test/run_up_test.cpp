#include <gtest/gtest.h>

#include <cmath>

#include "whirl/rig/records.hpp"
#include "whirl/rig/segments.hpp"
#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {
namespace {

TEST(RunUpProperty, BalancedRotorPeaksAboveItsRunDown) {
  // A hardening rotor follows the resonance upwards when it runs up.
  RigParameters p;
  p.rotor.added_mass = 0;
  const OpenLoopRecord down = record_open_loop(p), up = record_open_loop(p.run_up());
  EXPECT_EQ(up.truth.size(), 14000);
  EXPECT_EQ(up.truth["omega"][500], 0);
  EXPECT_GT(up.truth["x"].cwiseAbs().maxCoeff(), down.truth["x"].cwiseAbs().maxCoeff());
  Eigen::Index at = 0;
  up.truth["x"].cwiseAbs().maxCoeff(&at);
  EXPECT_GT(up.truth["omega"][at], p.natural_frequency());
  const std::vector<int> s = segments(up.truth["omega"], p.natural_frequency());
  EXPECT_EQ(s.front(), 3);
  EXPECT_EQ(s.back(), 0);
}

TEST(RunUpProperty, VelocityFeedbackKeepsTheFiveGramRunUpSmall) {
  VirtualRig rig(RigParameters{}.run_up());
  const RigTruth truth(rig);
  double x = 0, y = 0, vx = 0, vy = 0, peak = 0;
  while (!rig.done()) {
    const Measurement m = rig.read();
    vx += 0.5 * ((m.x - x) * 1e3 - vx);
    vy += 0.5 * ((m.y - y) * 1e3 - vy);
    x = m.x, y = m.y;
    rig.write({-60 * vx, -60 * vy});
    rig.advance();
    if (rig.tick() > 500) peak = std::max(peak, std::abs(truth.z().real()));
  }
  EXPECT_LT(peak, 1e-3);
  EXPECT_GT(peak, 0.1e-3);
}

}  // namespace
}  // namespace whirl::rig
