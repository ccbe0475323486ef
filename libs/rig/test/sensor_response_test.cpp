#include "whirl/rig/sensor_response.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <complex>

#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {
namespace {

double clamped(double v, double limit) { return std::clamp(v, -limit, limit); }

/// Response to e^{i omega t} read every dt, after the start has died away: of the low-pass, 1 / (1 + i omega / w).
std::complex<double> response(const RigLaser& laser, double omega, double dt) {
  SensorMemory<double> re, im;
  const SensorResponse r(laser, dt);
  std::complex<double> last, input;
  re.start(1), im.start(0);
  for (int k = 1; k < 4000; ++k) {
    input = std::polar(1.0, omega * dt * k);
    re.follow(r, input.real(), clamped), im.follow(r, input.imag(), clamped);
    last = {re.read, im.read};
  }
  return last / input;
}

TEST(SensorResponseReference, LowPassHasTheGainAndPhaseOfItsDataSheet) {
  RigLaser laser;
  laser.bandwidth = 150;
  for (const double frequency : {2.0, 12.0, 46.0}) {
    const double omega = kTwoPi * frequency;
    const std::complex<double> expected = 1.0 / std::complex<double>(1, frequency / laser.bandwidth);
    // A straight line in the place of an arc: (omega dt)^2 / 12.
    EXPECT_LT(std::abs(response(laser, omega, 1e-3) - expected), 1.05 / 12 * std::pow(omega * 1e-3, 2)) << frequency;
    EXPECT_LT(std::abs(response(laser, omega, 1e-4) - expected), 2e-4) << frequency;
  }
  // Slow motion is late by the time constant.
  EXPECT_NEAR(laser.delay() - laser.latency, -std::arg(response(laser, 1, 1e-3)), 1e-6);
}

TEST(SensorResponseReference, PlayIsHalfItsWidthBehind) {
  RigLaser laser;
  laser.hysteresis = 4e-6;
  const SensorResponse r(laser, 1e-3);
  SensorMemory<double> m;
  m.start(0);
  m.follow(r, 1e-6, clamped);
  EXPECT_EQ(m.read, 0);
  m.follow(r, 10e-6, clamped);
  EXPECT_NEAR(m.read, 8e-6, 1e-18);
  m.follow(r, 7e-6, clamped);
  EXPECT_NEAR(m.read, 8e-6, 1e-18);
  m.follow(r, 0, clamped);
  EXPECT_NEAR(m.read, 2e-6, 1e-18);
}

// Without either the readings are what they were.
TEST(SensorResponseUnit, NothingStatedChangesNothing) {
  const RigLaser laser;
  const SensorResponse r(laser, 1e-3);
  SensorMemory<double> m;
  m.start(0.1);
  m.follow(r, -0.3, clamped);
  EXPECT_EQ(m.read, -0.3);
  EXPECT_FALSE(has_response(laser));
  EXPECT_EQ(laser.delay(), laser.latency);
}

// The rig's readings lag the disk by low-pass and latency.
TEST(SensorResponseE2e, ReadingsOfTheRigLagTheDisk) {
  RigParameters p;
  p.laser.noise = 0, p.laser.bits = 0, p.laser.runout_1x = p.laser.runout_2x = p.laser.runout_3x = 0;
  p.laser.bandwidth = 100, p.laser.latency = 0, p.laser.rate = 0;
  p.modes.clear();
  VirtualRig rig(make_rig_tables(p), {});
  const RigTruth truth(rig);
  std::complex<double> sum;
  double omega = 0;
  for (long k = 0; k < 1000; ++k) {
    const Measurement m = rig.read();
    sum += std::complex<double>(m.x, m.y) * std::conj(truth.z());
    omega += truth.angle().omega / 1000;
    rig.advance();
  }
  EXPECT_NEAR(-std::arg(sum), std::atan(omega / (kTwoPi * 100)), 0.02);
}

}  // namespace
}  // namespace whirl::rig
