#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {
namespace {

// A heavily damped rotor at standstill: force in, static deflection and lag out.
RigParameters quiet_rig() {
  RigParameters p;
  p.rotor.residual_eccentricity = p.rotor.added_mass = 0;
  p.rotor.cubic = 0;
  p.rotor.damping = 100;
  p.rotor.stiffness_split = p.rotor.damping_split = p.rotor.cross_stiffness = 0;
  p.profile = rotor::SpeedProfile{};
  p.modes.clear();
  p.laser.noise = p.laser.runout_1x = p.laser.runout_2x = p.laser.runout_3x = 0;
  return p;
}

void run(VirtualRig& rig, int ticks, Command c) {
  for (int i = 0; i < ticks; ++i) {
    rig.write(c);
    rig.advance();
  }
}

TEST(VirtualRigReference, ForceGoesThroughConverterGainAndAxes) {
  RigParameters p = quiet_rig();
  VirtualRig rig(p);
  run(rig, 900, {10, 0});
  const RigTruth truth(rig);
  const double volts = std::round(2.5 / (20.0 / 65536)) * (20.0 / 65536);
  EXPECT_NEAR(truth.commanded().real(), volts * 4, 1e-12);
  const std::complex<double> force = std::polar(volts * 4 * 0.96, 2 * M_PI / 180);
  EXPECT_NEAR(std::abs(truth.force() - force), 0, 1e-9);
  EXPECT_NEAR(std::abs(truth.z() - force / 8500.0), 0, 1e-7);
  const double lsb = 25e-3 / 65536;
  EXPECT_NEAR(rig.read().x, truth.z().real(), 0.5 * lsb + 1e-12);
}

TEST(VirtualRigReference, ForceIsLimitedAndNonsenseIsNoForce) {
  VirtualRig rig(quiet_rig());
  const RigTruth truth(rig);
  run(rig, 5, {1e9, -std::numeric_limits<double>::infinity()});
  EXPECT_EQ(truth.commanded(), std::complex<double>(40, -40));
  run(rig, 5, {std::nan(""), 0});
  EXPECT_EQ(truth.commanded(), std::complex<double>(0, 0));
}

// The lag lets a force die out exponentially: below the smallest normal number every step would take ten times as long.
TEST(VirtualRigProperty, AForceThatIsSwitchedOffEnds) {
  VirtualRig rig(quiet_rig());
  const RigTruth truth(rig);
  run(rig, 50, {10, -5});
  run(rig, 20, {0, 0});
  EXPECT_GT(std::abs(truth.force()), 0);
  run(rig, 2000, {0, 0});
  EXPECT_EQ(truth.force(), std::complex<double>(0, 0));
}

TEST(VirtualRigReference, CommandActsOneTickLaterThroughTheLag) {
  for (int extra : {0, 2}) {
    RigParameters p = quiet_rig();
    p.actuator.bits = 0;
    p.actuator.gain_error = p.actuator.axis_rotation = 0;
    p.actuator.extra_delay_samples = extra;
    VirtualRig rig(p);
    const RigTruth truth(rig);
    for (int k = 0; k < 1 + extra; ++k) {
      run(rig, 1, {8, 0});
      EXPECT_EQ(truth.force().real(), 0) << k;
    }
    run(rig, 1, {8, 0});
    EXPECT_NEAR(truth.force().real(), 8 * (1 - std::exp(-2 * M_PI * 200 * 1e-3)), 1e-12);
  }
}

TEST(VirtualRigConvergence, ForcedMotionDoesNotDependOnSubsteps) {
  std::complex<double> end[3];
  double reading[3];
  int i = 0;
  for (int n : {4, 8, 32}) {
    RigParameters p;
    p.timing.substeps = n;
    VirtualRig rig(p);
    for (int k = 0; k < 3000; ++k) {
      rig.write({20 * std::sin(0.3 * k), k % 40 < 20 ? 15.0 : -15.0});
      rig.advance();
    }
    end[i] = RigTruth(rig).z();
    reading[i++] = rig.read().x;
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(std::abs(end[k] - end[2]), 0, 1e-6 * std::abs(end[2]));
    EXPECT_NEAR(reading[k], reading[2], 0.39e-6);  // one step of the converter
  }
}

TEST(VirtualRigReference, ModesAreSeenByTheSensorAndDrivenByTheActuator) {
  RigParameters p = quiet_rig();
  p.modes = {{46, 0.05, 0.5, -1, 0}};
  p.laser.bits = 0;
  p.actuator.gain_error = p.actuator.axis_rotation = 0;
  VirtualRig rig(p);
  run(rig, 990, {10, 0});
  const double mode = 0.5 * 10 / 1.5 / std::pow(2 * M_PI * 46, 2);
  EXPECT_NEAR(rig.read().x - RigTruth(rig).z().real(), -mode, 0.01 * mode);

  // Free: the initial deflection decays with the mode's frequency, seen a latency later.
  p.modes = {{46, 0.008, 0.03, 1, 30e-6}};
  p.laser.latency = 0;
  VirtualRig free(p);
  for (int k = 0; k < 200; ++k) {
    const double w = 2 * M_PI * 46, wd = w * std::sqrt(1 - 0.008 * 0.008), t = 1e-3 * k;
    const double q = 30e-6 * std::exp(-0.008 * w * t) * (std::cos(wd * t) + 0.008 * w / wd * std::sin(wd * t));
    ASSERT_NEAR(free.read().x, q, 1e-11) << k;
    free.advance();
  }
}

TEST(VirtualRig, SensorLossIsFullScaleAndMarked) {
  RigRun run_spec;
  run_spec.faults = {{RigFault::sensor_loss, 0.1, 0.15, RigAxis::x}};
  VirtualRig rig(RigParameters{}, run_spec), whole(RigParameters{});
  for (int k = 0; k < 300; ++k, rig.advance(), whole.advance()) {
    const bool lost = k >= 100 && k < 150;
    ASSERT_EQ(rig.read().valid, !lost) << k;
    ASSERT_EQ(rig.read().y, whole.read().y);
    if (lost) {
      ASSERT_EQ(rig.read().x, 12.5e-3);
    } else {
      ASSERT_EQ(rig.read().x, whole.read().x);
    }
  }
}

TEST(VirtualRig, StuckSensorRepeatsItsLastReading) {
  RigRun run_spec;
  run_spec.faults = {{RigFault::sensor_stuck, 0.1, 0.15}};
  VirtualRig rig(RigParameters{}, run_spec);
  double last = 0;
  for (int k = 0; k < 200; ++k, rig.advance()) {
    if (k == 99) last = rig.read().x;
    if (k >= 100 && k < 150) {
      ASSERT_EQ(rig.read().x, last);
      ASSERT_TRUE(rig.read().valid);
    }
  }
  EXPECT_NE(rig.read().x, last);
}

TEST(VirtualRig, ScriptedDelayHoldsCommandsBack) {
  RigParameters p = quiet_rig();
  p.actuator.bandwidth = 0;
  p.actuator.bits = 0;
  RigRun run_spec;
  run_spec.faults = {{RigFault::extra_delay, 0.05, 0.10, RigAxis::both, 3}};
  VirtualRig rig(p, run_spec);
  const RigTruth truth(rig);
  for (int k = 0; k < 150; ++k) {
    rig.write({0.01 * k, 0});
    rig.advance();
    const int delay = k >= 50 && k < 100 ? 4 : 1;
    ASSERT_NEAR(truth.commanded().real(), k < delay ? 0 : 0.01 * (k - delay), 1e-12) << k;
  }
}

TEST(VirtualRig, LostActuatorGivesNoForceOnItsAxis) {
  RigRun run_spec;
  run_spec.faults = {{RigFault::actuator_loss, 0.05, 0.10, RigAxis::y}};
  VirtualRig rig(quiet_rig(), run_spec);
  const RigTruth truth(rig);
  for (int k = 0; k < 150; ++k) {
    run(rig, 1, {8, 8});
    ASSERT_NEAR(truth.commanded().real(), k == 0 ? 0 : 8, 1e-3) << k;
    ASSERT_NEAR(truth.commanded().imag(), k == 0 || (k >= 50 && k < 100) ? 0 : 8, 1e-3) << k;
  }
}

TEST(VirtualRig, StuckEncoderRepeatsTheAngle) {
  RigRun run_spec;
  run_spec.faults = {{RigFault::encoder_stuck, 0.05, 0.10}};
  VirtualRig rig(RigParameters{}, run_spec), whole(RigParameters{});
  double last = 0;
  for (int k = 0; k < 150; ++k, rig.advance(), whole.advance()) {
    if (k < 50) last = rig.read().beta;
    ASSERT_EQ(rig.read().beta, k >= 50 && k < 100 ? last : whole.read().beta) << k;
    ASSERT_EQ(rig.read().x, whole.read().x);
  }
}

TEST(VirtualRigProperty, RestartRepeatsTheRun) {
  VirtualRig rig(RigParameters{}, {.seed = 11});
  std::vector<double> first;
  for (int k = 0; k < 500; ++k) {
    first.push_back(rig.read().x);
    run(rig, 1, {3, 4});
  }
  rig.restart(11);
  for (int k = 0; k < 500; ++k) {
    ASSERT_EQ(rig.read().x, first[static_cast<std::size_t>(k)]);
    run(rig, 1, {3, 4});
  }
  rig.restart(12);
  EXPECT_NE(rig.read().x, first[0]);
}

TEST(VirtualRigProperty, SharedAngleTablesGiveTheSameRun) {
  const auto first = make_rig_tables(RigParameters{});
  RigParameters other;
  other.rotor.stiffness *= 0.7;
  other.rotor.added_mass = 2e-3;
  VirtualRig shared(make_rig_tables(other, first), {}), own(other);
  other.profile.ripple = 0;  // another angle: must not be shared
  VirtualRig smooth(make_rig_tables(other, first), {}), smooth_own(other);
  for (int k = 0; k < 3000; ++k) {
    ASSERT_EQ(shared.read().x, own.read().x);
    ASSERT_EQ(smooth.read().x, smooth_own.read().x);
    for (VirtualRig* rig : {&shared, &own, &smooth, &smooth_own}) rig->advance();
  }
  EXPECT_NE(smooth.read().beta, own.read().beta);
}

// Tables are kept from rig to rig: what they depend on is never taken from another one.
TEST(VirtualRigProperty, EveryParameterOfTheAngleHasTablesOfItsOwn) {
  const auto readings = [](const RigParameters& p) {
    std::vector<double> all;
    VirtualRig rig(p);
    for (int k = 0; k < 400; ++k, rig.advance()) {
      const Measurement m = rig.read();
      all.insert(all.end(), {m.x, m.y, m.beta, m.omega});
    }
    return all;
  };
  RigParameters base;
  base.profile.ripple = 0.01, base.profile.ripple_omega = 40, base.profile.dwell_start = 0.1;
  base.laser.bits = 0;  // the smallest difference shows
  const std::vector<double> of_base = readings(base);
  const std::vector<std::pair<const char*, std::function<void(RigParameters&)>>> changes{
      {"start speed", [](RigParameters& p) { p.profile.omega_start *= 1.01; }},
      {"end speed", [](RigParameters& p) { p.profile.omega_end += 1; }},
      {"dwell", [](RigParameters& p) { p.profile.dwell_start *= 0.9; }},
      {"ramp", [](RigParameters& p) { p.profile.ramp_time *= 0.9; }},
      {"ripple", [](RigParameters& p) { p.profile.ripple *= 2; }},
      {"ripple's speed", [](RigParameters& p) { p.profile.ripple_omega *= 1.1; }},
      {"ripple's phase", [](RigParameters& p) { p.profile.ripple_phase += 1; }},
      {"start angle", [](RigParameters& p) { p.profile.beta_start += 0.1; }},
      {"rate of the lasers", [](RigParameters& p) { p.laser.rate = 2000; }},
      {"their latency", [](RigParameters& p) { p.laser.latency += 0.5e-3; }},
      {"counts", [](RigParameters& p) { p.encoder.counts = 100; }},
      {"tracking",
       [](RigParameters& p) {
         p.encoder = {1024, 8, false};
       }},
      {"no encoder", [](RigParameters& p) { p.encoder.profile_angle = true; }},
      {"rate of the loop", [](RigParameters& p) { p.timing.rate = 2000; }},
      {"steps", [](RigParameters& p) { p.timing.substeps = 8; }}};
  for (const auto& [what, change] : changes) {
    RigParameters other = base;
    change(other);
    EXPECT_NE(readings(other), of_base) << what;
    EXPECT_EQ(readings(base), of_base) << "after another " << what;
  }
}

TEST(VirtualRig, EndsWithItsProfile) {
  RigParameters p = quiet_rig();
  p.profile.ramp_time = 0.25;
  VirtualRig rig(p);
  int ticks = 0;
  for (; !rig.done(); rig.advance()) ++ticks;
  EXPECT_EQ(ticks, 250);
  EXPECT_EQ(rig.ticks(), 250);
  rig.advance();
  EXPECT_EQ(rig.tick(), 250);
}

TEST(VirtualRig, DivergenceIsShownNotThrown) {
  RigParameters p = quiet_rig();
  p.rotor.cubic = -1e15;  // no restoring force beyond 3 um
  VirtualRig rig(p);
  run(rig, 900, {10, 0});
  EXPECT_FALSE(RigTruth(rig).finite());
  EXPECT_FALSE(rig.read().valid);
  EXPECT_TRUE(std::isfinite(rig.read().x));
}

TEST(EncoderReference, CountsAndTrackingLoop) {
  VirtualRig rig(RigParameters{});
  double worst_angle = 0, worst_speed = 0, worst_acceleration = 0;
  for (int k = 0; k < 12900; ++k, rig.advance()) {
    const rotor::AngleState a = RigTruth(rig).angle();
    const Measurement m = rig.read();
    worst_angle = std::max(worst_angle, std::abs(m.beta - a.beta));
    worst_speed = std::max(worst_speed, std::abs(m.omega - a.omega));
    worst_acceleration = std::max(worst_acceleration, std::abs(m.omega_dot - a.alpha));
  }
  EXPECT_LE(worst_angle, M_PI / 1024 * 1.000001);
  EXPECT_GT(worst_angle, 0.9 * M_PI / 1024);
  EXPECT_LT(worst_speed, 0.2);         // of 188 rad/s
  EXPECT_LT(worst_acceleration, 3.0);  // of 14.5 rad/s^2, ripple included
}

TEST(EncoderReference, ProfileAngleLeavesTheRippleOut) {
  RigParameters p;
  p.encoder.profile_angle = true;
  VirtualRig rig(p);
  double worst = 0;
  for (int k = 0; k < 12000; ++k, rig.advance()) {
    EXPECT_NEAR(rig.read().omega_dot, -p.profile.omega_start / 13, 1e-9);
    worst = std::max(worst, std::abs(rig.read().beta - RigTruth(rig).angle().beta));
  }
  // Ripple amplitude 0.4 % of 188 rad/s at 0.7 Hz: 0.17 rad, up to twice that from its start.
  EXPECT_GT(worst, 0.1);
  EXPECT_LT(worst, 0.4);
}

}  // namespace
}  // namespace whirl::rig
