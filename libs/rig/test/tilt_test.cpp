// The gyroscopic rotor in the rig: whirl frequencies over speed, unbalance, integrator, tests at rest.
#include "whirl/rig/tilt.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/rig/batch.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rig {
namespace {

using Complex = std::complex<double>;

/// A thin disk at 0.16 m of a hinged 0.44 m shaft, everything but the rotor exact.
RigParameters tilting(double speed) {
  RigParameters p = RigParameters::ideal_rotor_a();
  p.rotor.mass = 1.5;
  p.rotor.added_mass = 0;
  p.rotor.cubic = 0;
  p.rotor.damping = 0.5;
  const rotor::ShaftStiffness shaft = rotor::ShaftStiffness::hinged(13, 0.16, 0.28);
  p.rotor.stiffness = shaft.k11 - shaft.k12 * shaft.k12 / shaft.k22;
  p.tilt.polar = 6e-3;
  p.tilt.diametral = 3.2e-3;
  p.tilt.stiffness = shaft.k22;
  p.tilt.coupling = shaft.k12;
  p.tilt.damping_ratio = 0.001;
  p.tilt.couple_unbalance = 1e-3;
  p.tilt.couple_phase = -0.8;
  p.profile = rotor::SpeedProfile{};
  p.profile.omega_start = p.profile.omega_end = speed;
  p.profile.ramp_time = 8;
  p.timing.substeps = 16;
  return p;
}

// One blow at constant speed; the free whirl shows its four frequencies, forward and backward, where the roots of the
// characteristic equation are: a Campbell diagram point by point.
TEST(TiltedRigReference, WhirlFrequenciesFollowTheCharacteristicEquationOverSpeed) {
  for (const double speed : {0.0, 60.0, 140.0, 260.0}) {
    RigParameters p = tilting(speed);
    p.rotor.residual_eccentricity = p.tilt.couple_unbalance = 0;
    VirtualRig rig(p);
    const RigTruth truth(rig);
    std::vector<Complex> z;
    for (; !rig.done(); rig.advance()) {
      rig.write({rig.tick() == 10 ? 30.0 : 0.0, 0});
      if (rig.tick() > 12) z.push_back(truth.z());
    }
    const double h = 1 / p.timing.rate, length = static_cast<double>(z.size());
    const auto amplitude = [&](double w) {
      Complex sum = 0;
      for (std::size_t k = 0; k < z.size(); ++k) {
        const double window = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(k) / length);
        sum += window * z[k] * std::polar(1.0, -w * h * static_cast<double>(k));
      }
      return std::abs(sum);
    };
    const Eigen::Vector4cd poles = rotor::whirl_poles(gyroscopic_rotor(p), speed);
    for (const Complex pole : poles) {
      double best = 0, found = 0;
      for (double w = pole.imag() - 3; w <= pole.imag() + 3; w += 0.05) {
        const double a = amplitude(w);
        if (a > best) best = a, found = w;
      }
      EXPECT_NEAR(found, pole.imag(), 0.1) << "speed " << speed;
    }
    if (speed == 0) continue;
    EXPECT_GT(poles[3].imag() + poles[0].imag(), 0.2 * speed);  // forward and backward have split
  }
}

// The quartic m Id w^4 - m Ip Omega w^3 - (m k22 + Id k11) w^2 + Ip Omega k11 w + k11 k22 - k12^2 = 0 by Newton's
// method.
TEST(TiltedRigReference, UndampedWhirlFrequenciesAreTheRootsOfTheQuartic) {
  RigParameters p = tilting(0);
  p.rotor.damping = p.tilt.damping_ratio = 0;
  const rotor::GyroscopicRotor r = gyroscopic_rotor(p);
  for (double omega = 0; omega <= 400; omega += 50) {
    for (const Complex pole : rotor::whirl_poles(r, omega)) {
      double w = 1.02 * pole.imag();
      for (int i = 0; i < 20; ++i) {
        const double a = r.mass * r.diametral, b = -r.mass * r.polar * omega,
                     c = -(r.mass * r.shaft.k22 + r.diametral * r.shaft.k11), d = r.polar * omega * r.shaft.k11,
                     e = r.shaft.k11 * r.shaft.k22 - r.shaft.k12 * r.shaft.k12;
        w -= ((((a * w + b) * w + c) * w + d) * w + e) / (((4 * a * w + 3 * b) * w + 2 * c) * w + d);
      }
      EXPECT_NEAR(pole.imag(), w, 1e-7 * std::abs(w)) << omega;
      EXPECT_NEAR(pole.real(), 0, 1e-7 * std::abs(w));
    }
  }
}

TEST(TiltedRigReference, StaysInTheSteadyWhirlOfStaticAndCoupleUnbalance) {
  const RigParameters p = tilting(150);
  VirtualRig rig(p);
  const RigTruth truth(rig);
  const Eigen::Vector2cd steady = rotor::steady_unbalance(gyroscopic_rotor(p), 150);
  EXPECT_GT(std::abs(steady[1]), 1e-5);
  for (int k = 0; k < 3000; ++k) rig.advance();
  const Complex turn = std::polar(1.0, truth.angle().beta);
  EXPECT_NEAR(std::abs(truth.z() - steady[0] * turn), 0, 1e-6 * std::abs(steady[0]));
  EXPECT_NEAR(std::abs(truth.tilt() - steady[1] * turn), 0, 1e-6 * std::abs(steady[1]));
}

TEST(TiltedRigReference, RunDownIsThatOfTheRotorLibrary) {
  RigParameters p = tilting(0);
  p.rotor.cubic = 1e7;
  p.profile = rotor::SpeedProfile::run_down(300, 4);
  VirtualRig rig(p);
  const RigTruth truth(rig);
  const rotor::GyroscopicResponse expected =
      simulate(gyroscopic_rotor(p), rotor::angle_signal(p.profile, 1 / (1000.0 * 16)));
  double worst = 0, peak = 0;
  for (; !rig.done(); rig.advance()) {
    const Complex z = expected.z[16 * rig.tick()];
    worst = std::max(worst, std::abs(truth.z() - z));
    peak = std::max(peak, std::abs(z));
  }
  EXPECT_LT(worst, 1e-9 * peak);
}

TEST(TiltedRigConvergence, OrderIsFour) {
  const auto end = [](int substeps) {
    RigParameters p = tilting(0);
    p.profile = rotor::SpeedProfile::run_down(250, 2);
    p.rotor.cubic = 1e7;
    p.timing.substeps = substeps;
    VirtualRig rig(p);
    for (int k = 0; k < 1500; ++k) rig.advance();
    return RigTruth(rig).z();
  };
  const Complex truth = end(64);
  EXPECT_NEAR(std::log2(std::abs(end(1) - truth) / std::abs(end(2) - truth)), 4, 0.2);
}

TEST(TiltedRig, WithoutCouplingTheDeflectionIsThatOfThePaper) {
  RigParameters p, plain;
  p.tilt = tilting(0).tilt;
  p.tilt.coupling = 0;
  // The start is the steady whirl of the isotropic linear rotor.
  for (RigParameters* q : {&p, &plain}) {
    q->rotor.cubic = 0;
    q->rotor.stiffness_split = q->rotor.damping_split = q->rotor.cross_stiffness = 0;
  }
  EXPECT_NEAR(p.natural_frequency(), plain.natural_frequency(), 1e-9);
  VirtualRig a(p), b(plain);
  for (int k = 0; k < 14000; ++k, a.advance(), b.advance()) {
    ASSERT_NEAR(std::abs(RigTruth(a).z() - RigTruth(b).z()), 0, 1e-11) << k;
  }
}

TEST(TiltedRig, HammerTestShowsTheTiltModeAndThePullTestTheStaticStiffness) {
  const RigParameters p = tilting(0);
  HammerTestOptions hammer;
  hammer.blows = 1;
  hammer.bits = 0;
  hammer.converter_noise = 0;
  const Recording blow = simulate_hammer_test(p, hammer)[0];
  const double tilt = rotor::whirl_poles(gyroscopic_rotor(p), 0)[3].imag();
  const auto amplitude = [&](double w) {
    Complex sum = 0;  // of the ring-down behind the blow
    for (Eigen::Index i = 200; i < blow.size(); ++i) {
      const double part = static_cast<double>(i - 200) / static_cast<double>(blow.size() - 200);
      sum += (1 - std::cos(2 * std::numbers::pi * part)) * blow["acc_x"][i] *
             std::polar(1.0, -w * blow.dt * static_cast<double>(i));
    }
    return std::abs(sum);
  };
  EXPECT_GT(amplitude(tilt), 10 * amplitude(0.8 * tilt));
  EXPECT_GT(amplitude(tilt), 10 * amplitude(1.2 * tilt));
  EXPECT_GT(amplitude(rotor::whirl_poles(gyroscopic_rotor(p), 0)[2].imag()), 10 * amplitude(0.8 * tilt));
  StiffnessTestOptions pull;
  pull.force_noise = pull.force_resolution = pull.deflection_resolution = pull.zero_offset = 0;
  const StiffnessTable table = simulate_stiffness_test(p, pull);
  EXPECT_NEAR(table.force[10] / table.deflection[10], p.rotor.stiffness, 1e-6 * p.rotor.stiffness);
}

TEST(TiltedRig, RefusesImpossibleBodiesAndLanes) {
  RigParameters p = tilting(0);
  const auto tables = make_rig_tables(p);
  EXPECT_THROW(BatchRig<8>{tables}, Error);
  p.tilt.polar = 3 * p.tilt.diametral;
  EXPECT_THROW(p.check(), Error);
  EXPECT_THROW(gyroscopic_rotor(RigParameters{}), Error);
}

}  // namespace
}  // namespace whirl::rig
