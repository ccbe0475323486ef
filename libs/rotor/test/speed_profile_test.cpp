#include "whirl/rotor/speed_profile.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rotor {
namespace {

SpeedProfile rippled() {
  SpeedProfile p;
  p.omega_start = 188;
  p.omega_end = 20;
  p.dwell_start = 0.5;
  p.ramp_time = 3;
  p.dwell_end = 1;
  p.ripple = 0.02;
  p.ripple_omega = 9;
  p.ripple_phase = 0.3;
  p.beta_start = 1.1;
  return p;
}

TEST(SpeedProfileProperty, SpeedAndAccelerationAreDerivativesOfTheAngle) {
  const SpeedProfile p = rippled();
  const double h = 1e-4;
  for (double t : {0.1, 0.49, 0.7, 2.0, 3.4, 3.6, 4.4}) {
    const AngleState a = p.at(t), before = p.at(t - h), after = p.at(t + h);
    EXPECT_NEAR((after.beta - before.beta) / (2 * h), a.omega, 1e-5) << t;
    EXPECT_NEAR((after.omega - before.omega) / (2 * h), a.alpha, 1e-4) << t;
  }
}

TEST(SpeedProfileProperty, AngleIsContinuousAtTheEndsOfTheRamp) {
  const SpeedProfile p = rippled();
  for (double t : {0.5, 3.5}) {
    EXPECT_NEAR(p.at(t - 1e-9).beta, p.at(t + 1e-9).beta, 1e-6);
    EXPECT_NEAR(p.at(t - 1e-9).omega, p.at(t + 1e-9).omega, 1e-6);
  }
  EXPECT_DOUBLE_EQ(p.at(0).beta, 1.1);
}

TEST(SpeedProfileReference, RunDownTurnsHalfSpeedTimesTime) {
  const SpeedProfile p = SpeedProfile::run_down(188, 13, 1);
  EXPECT_NEAR(p.at(14).beta, 0.5 * 188 * 13, 1e-9);
  EXPECT_EQ(p.at(13.5).omega, 0);
  EXPECT_EQ(p.at(13.5).alpha, 0);
  EXPECT_NEAR(p.at(5).alpha, -188.0 / 13, 1e-12);
}

TEST(SpeedProfile, SignalHoldsSamplesAndMidpoints) {
  const SpeedProfile p = rippled();
  const AngleSignal s = angle_signal(p, 1e-3);
  EXPECT_EQ(s.samples(), 4500);
  EXPECT_EQ(s.beta.size(), 8999);
  EXPECT_DOUBLE_EQ(s.beta[2001], p.at(1.0005).beta);
  EXPECT_EQ(angle_signal(p, 1e-3, 10).samples(), 10);
}

TEST(SpeedProfile, RejectsImpossibleFields) {
  SpeedProfile p;
  p.ramp_time = 0;
  EXPECT_THROW(p.check(), Error);
  p.ramp_time = 1;
  p.ripple = 0.1;
  EXPECT_THROW(p.check(), Error);  // no ripple frequency
  EXPECT_THROW(angle_signal(SpeedProfile::run_down(10, 1), 0.0, 5), Error);
}

/// Angle of a balanced rotor of 0.01 kg m^2 that the torque turns.
AngleSignal turned_by(const TorqueModel& torque, double beta, double omega, double dt, Eigen::Index samples) {
  const UnbalancedDisk disk{.mass = 1, .inertia = 0.01, .stiffness = 1000};
  return simulate_driven(disk, torque, {.beta = beta, .omega = omega}, dt, samples).angle;
}

TEST(TorqueReference, ViscousCoastDownIsExponential) {
  TorqueModel torque;
  torque.viscous = 0.02;
  const AngleSignal a = turned_by(torque, 0.5, 100, 1e-3, 1001);
  for (Eigen::Index i : {400, 1000, 2000}) {
    const double t = 0.5e-3 * static_cast<double>(i);
    EXPECT_NEAR(a.omega[i], 100 * std::exp(-2 * t), 1e-9);
    EXPECT_NEAR(a.beta[i], 0.5 + 50 * (1 - std::exp(-2 * t)), 1e-9);
    EXPECT_NEAR(a.alpha[i], -200 * std::exp(-2 * t), 1e-8);
  }
}

TEST(TorqueReference, DragCoastDownIsHyperbolic) {
  TorqueModel torque;
  torque.drag = 1e-4;
  const AngleSignal a = turned_by(torque, 0, 100, 1e-3, 2001);
  EXPECT_NEAR(a.omega[4000], 100 / (1 + 1e-2 * 100 * 2.0), 1e-8);
}

TEST(TorqueReference, CoulombFrictionStopsTheRotorForGood) {
  TorqueModel torque;
  torque.coulomb = 0.1;  // 10 rad/s^2: stops from 20 rad/s after 2 s and 20 rad
  const AngleSignal a = turned_by(torque, 0, 20, 1e-3, 3001);
  EXPECT_NEAR(a.omega[3000], 5, 1e-9);
  EXPECT_EQ(a.omega[4100], 0);
  EXPECT_NEAR(a.beta[6000], 20, 1e-6);
  torque.motor = 0.05;
  EXPECT_EQ(torque.torque(0), 0);
  torque.motor = 0.3;
  EXPECT_NEAR(torque.torque(0), 0.2, 1e-15);
}

TEST(TorqueReference, MotorRunsUpToItsBalanceSpeed) {
  TorqueModel torque{.motor = 2, .motor_slope = 0.01, .coulomb = 0.1, .viscous = 0.009};
  const AngleSignal a = turned_by(torque, 0, 0, 1e-3, 8001);
  EXPECT_NEAR(a.omega.tail<1>()[0], 1.9 / 0.019, 1e-4);
}

}  // namespace
}  // namespace whirl::rotor
