#include "whirl/rig/batch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace whirl {
namespace {

// Velocity feedback with another gain in every lane, against the scalar rig.
template <int Lanes>
double worst_difference(const RigParameters& p, long ticks) {
  const auto tables = make_rig_tables(p);
  BatchRig<Lanes> batch(tables, 5);
  std::vector<VirtualRig> scalar;
  for (int lane = 0; lane < Lanes; ++lane) scalar.emplace_back(tables, RigRun{.seed = 5});
  LaneArray<Lanes> last_x, last_y, ux, uy;
  std::vector<Measurement> last(Lanes);
  double worst = 0;
  for (long k = 0; k < ticks && !batch.done(); ++k) {
    const auto& m = batch.read();
    for (int lane = 0; lane < Lanes; ++lane) {
      const double gain =
          2.1371e3 * lane;  // not commensurate with the converter steps: ties round either way
      ux[lane] = -gain * (m.x[lane] - last_x[lane]);
      uy[lane] = -gain * (m.y[lane] - last_y[lane]);
      VirtualRig& rig = scalar[static_cast<std::size_t>(lane)];
      Measurement& old = last[static_cast<std::size_t>(lane)];
      const Measurement now = rig.read();
      rig.write({-gain * (now.x - old.x), -gain * (now.y - old.y)});
      old = now;
      worst = std::max(
          {worst, std::abs(batch.true_x()[lane] - RigTruth(rig).z().real()), std::abs(m.y[lane] - now.y)});
      rig.advance();
    }
    last_x = m.x, last_y = m.y;
    batch.write(ux, uy);
    batch.advance();
  }
  return worst;
}

TEST(BatchRigProperty, LanesOfTheFullRigEqualTheScalarRig) {
  RigParameters p;
  EXPECT_LT((worst_difference<8>(p, 14000)), 1e-9);
  p.laser.latency = 2.5e-3;  // readings of earlier ticks
  p.laser.rate = 500;        // each reading serves two ticks
  EXPECT_LT((worst_difference<16>(p, 1500)), 1e-9);
}

TEST(BatchRigProperty, LanesOfTheIdealRotorEqualTheScalarRig) {
  EXPECT_LT((worst_difference<32>(RigParameters::ideal_rotor_b(), 15000)), 1e-9);
  EXPECT_LT((worst_difference<8>(RigParameters::ideal_rotor_a().run_up(), 12000)), 1e-9);
}

TEST(BatchRig, RestartRepeatsAndLimitsHold) {
  BatchRig<8> batch(make_rig_tables({}), 3);
  LaneArray<8> u, zero;
  for (int lane = 0; lane < 8; ++lane) u[lane] = lane == 3 ? std::nan("") : 1e9;
  for (int k = 0; k < 20; ++k) {
    batch.write(u, zero);
    batch.advance();
  }
  const LaneArray<8> x = batch.true_x();
  EXPECT_TRUE(std::isfinite(x[3]));
  EXPECT_NE(x[0], x[3]);
  batch.restart(3);
  for (int k = 0; k < 20; ++k) {
    batch.write(u, zero);
    batch.advance();
  }
  EXPECT_EQ(batch.true_x().v, x.v);
  EXPECT_EQ(batch.tick(), 20);
}

}  // namespace
}  // namespace whirl
