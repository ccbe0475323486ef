#include "whirl/rig/batch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "whirl/core/error.hpp"

namespace whirl::rig {
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
      const double gain = 2.1371e3 * lane;  // not commensurate with the converter steps: ties round either way
      ux[lane] = -gain * (m.x[lane] - last_x[lane]);
      uy[lane] = -gain * (m.y[lane] - last_y[lane]);
      VirtualRig& rig = scalar[static_cast<std::size_t>(lane)];
      Measurement& old = last[static_cast<std::size_t>(lane)];
      const Measurement now = rig.read();
      rig.write({-gain * (now.x - old.x), -gain * (now.y - old.y)});
      old = now;
      worst = std::max({worst, std::abs(batch.true_x()[lane] - RigTruth(rig).z().real()), std::abs(m.y[lane] - now.y)});
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
  p.actuator.slew = 1500, p.actuator.hysteresis = 0.8;
  p.actuator.current_limit = 6, p.actuator.force_per_ampere = 2;
  EXPECT_LT((worst_difference<8>(p, 1500)), 1e-9);
  p.laser.bandwidth = 300, p.laser.hysteresis = 3e-6;
  EXPECT_LT((worst_difference<16>(p, 1500)), 1e-9);
}

TEST(BatchRigProperty, LanesOfTheIdealRotorEqualTheScalarRig) {
  EXPECT_LT((worst_difference<32>(RigParameters::ideal_rotor_b(), 15000)), 1e-9);
  EXPECT_LT((worst_difference<8>(RigParameters::ideal_rotor_a().run_up(), 12000)), 1e-9);
}

// Another rotor, runout, actuator and noise in every lane.
void expect_different_rigs_equal_scalar_ones(double mode_step, double sheet_step = 0) {
  std::array<std::shared_ptr<const RigTables>, 16> tables;
  std::array<std::uint64_t, 16> seeds;
  std::vector<VirtualRig> scalar;
  for (std::size_t i = 0; i < 16; ++i) {
    RigParameters p;
    const double d = static_cast<double>(i);
    p.rotor.stiffness *= 1 + 0.02 * d;
    p.rotor.cubic *= 1 - 0.03 * d;
    p.rotor.damping *= 1 + 0.1 * d;
    p.rotor.added_phase = 0.3 * d;
    p.laser.runout_phase_1x += d;
    p.laser.runout_phase_3x -= d;
    p.actuator.gain_error = 0.01 * d;
    p.actuator.axis_rotation = 0.002 * d;
    p.modes.front().participation *= 1 + 0.1 * d;
    p.modes.front().sensor_sign = i % 3 == 0 ? -1 : 1;
    p.modes.front().initial = 4e-6 * d;
    p.modes.front().frequency *= 1 + mode_step * d;
    p.actuator.hysteresis = 0.3;
    if (sheet_step > 0) {
      const double more = 1 + sheet_step * d;
      p.actuator.bandwidth *= more, p.actuator.hysteresis *= more;
      p.actuator.slew = 900 * more, p.actuator.current_limit = 4 * more, p.actuator.force_per_ampere = 2;
      p.laser.bandwidth = 150 * more, p.laser.hysteresis = 2e-6 * more;
      // What one machine's sheet does not state.
      if (i == 5) p.actuator.slew = p.actuator.hysteresis = p.laser.bandwidth = p.laser.hysteresis = 0;
    }
    tables[i] = make_rig_tables(p, tables[0]);
    seeds[i] = 7 + 3 * i;
    scalar.emplace_back(make_rig_tables(p), RigRun{.seed = seeds[i]});
  }
  BatchRig<16> batch(tables, seeds);
  LaneArray<16> last, ux, uy;
  double worst = 0, worst_force = 0;
  for (int k = 0; k < 14000; ++k) {
    const auto m = batch.read();
    for (int lane = 0; lane < 16; ++lane) {
      VirtualRig& rig = scalar[static_cast<std::size_t>(lane)];
      const Measurement now = rig.read();
      worst = std::max({worst, std::abs(now.x - m.x[lane]), std::abs(now.y - m.y[lane]),
                        std::abs(batch.true_x()[lane] - RigTruth(rig).z().real())});
      ux[lane] = -9371.3 * (m.x[lane] - last[lane]);
      uy[lane] = 0.7 * m.y[lane];
      rig.write({ux[lane], uy[lane]});
      rig.advance();
    }
    last = m.x;
    batch.write(ux, uy);
    batch.advance();
    for (int lane = 0; lane < 16; ++lane) {
      const double force = RigTruth(scalar[static_cast<std::size_t>(lane)]).commanded().real();
      worst_force = std::max(worst_force, std::abs(batch.commanded_x()[lane] - force));
    }
  }
  EXPECT_LT(worst, 1e-9) << mode_step;
  EXPECT_LT(worst_force, 1e-3) << mode_step;

  RigParameters heavy;
  heavy.rotor.mass *= 2;
  tables[3] = make_rig_tables(heavy, tables[0]);
  EXPECT_THROW(BatchRig<16>(tables, seeds), Error);
  RigParameters quick;
  quick.actuator.bandwidth = 0;
  tables[3] = make_rig_tables(quick, tables[0]);
  EXPECT_THROW(BatchRig<16>(tables, seeds), Error);
}

TEST(BatchRigProperty, LanesOfDifferentRigsEqualTheScalarRigs) {
  expect_different_rigs_equal_scalar_ones(0);
  expect_different_rigs_equal_scalar_ones(0.004);  // and of a mode, which each lane has elsewhere
  // And of other sensors and actuators in every lane.
  expect_different_rigs_equal_scalar_ones(0, 0.02);
  expect_different_rigs_equal_scalar_ones(0.004, 0.02);
}

TEST(BatchRigProperty, CoastingIsARunWithoutForceToTheLastBit) {
  const auto tables = make_rig_tables({});
  BatchRig<16> run(tables, 3), coast(tables, 3);
  for (; !run.done(); run.advance(), coast.coast()) {
    ASSERT_EQ(run.true_x().v, coast.true_x().v);
    ASSERT_EQ(run.true_y().v, coast.true_y().v);
  }
  EXPECT_TRUE(coast.done());
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
}  // namespace whirl::rig
