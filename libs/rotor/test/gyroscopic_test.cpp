#include "whirl/rotor/gyroscopic.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rotor {
namespace {

using Complex = std::complex<double>;

GyroscopicRotor overhung() {
  GyroscopicRotor r;
  r.mass = 1.5;
  r.polar = 6e-3;
  r.diametral = 3.2e-3;
  r.shaft = ShaftStiffness::cantilever(13, 0.2);
  r.damping = 2;
  r.tilt_damping = 2e-3;
  r.eps = std::polar(2e-4, 0.4);
  r.chi = std::polar(1e-3, -0.8);
  return r;
}

TEST(ShaftStiffnessReference, BeamFormulae) {
  // Tip flexibility L^3/3EI; disk in the middle of a hinged shaft 48 EI/L^3 and 12 EI/L, no coupling.
  const ShaftStiffness c = ShaftStiffness::cantilever(13, 0.2);
  EXPECT_NEAR(c.k22 / (c.k11 * c.k22 - c.k12 * c.k12), 0.008 / 39, 1e-12);
  const ShaftStiffness h = ShaftStiffness::hinged(13, 0.21, 0.21);
  EXPECT_NEAR(h.k11, 48 * 13 / std::pow(0.42, 3), 1e-6);
  EXPECT_NEAR(h.k12, 0, 1e-9);
  EXPECT_NEAR(h.k22, 12 * 13 / 0.42, 1e-9);
}

TEST(WhirlPolesReference, UncoupledTiltHasTheClosedForm) {
  // Id w^2 - Ip Omega w - k22 = 0.
  GyroscopicRotor r = overhung();
  r.shaft.k12 = 0;
  r.damping = r.tilt_damping = 0;
  const double omega = 300, root = std::sqrt(std::pow(r.polar * omega, 2) + 4 * r.diametral * r.shaft.k22);
  const double forward = (r.polar * omega + root) / (2 * r.diametral),
               backward = (r.polar * omega - root) / (2 * r.diametral);
  const Eigen::Vector4cd p = whirl_poles(r, omega);
  const double lateral = std::sqrt(r.shaft.k11 / r.mass);
  for (double expected : {forward, backward, lateral, -lateral}) {
    EXPECT_NEAR((p.array() - Complex(0, expected)).abs().minCoeff(), 0, 1e-8 * std::abs(expected));
  }
}

TEST(WhirlPolesProperty, GyroscopicEffectSplitsForwardFromBackward) {
  const GyroscopicRotor r = overhung();
  const Eigen::Vector4cd rest = whirl_poles(r, 0), fast = whirl_poles(r, 400);
  EXPECT_NEAR(rest[3].imag(), -rest[0].imag(), 1e-9);
  EXPECT_GT(fast[3].imag(), rest[3].imag() * 1.05);
  EXPECT_GT(fast[0].imag(), rest[0].imag());  // backward whirl slows down
  for (Complex p : fast) EXPECT_LT(p.real(), 0);
}

TEST(CriticalSpeedsProperty, AreTheSpeedsOfSynchronousForwardWhirl) {
  GyroscopicRotor r = overhung();
  r.damping = r.tilt_damping = 0;
  for (double polar : {6e-3, 3.2e-3, 1e-3}) {  // thin disk, sphere-like, long body
    r.polar = polar;
    const std::vector<double> speeds = critical_speeds(r);
    EXPECT_EQ(speeds.size(), polar > 3.3e-3 || polar == r.diametral ? 1u : 2u) << polar;
    for (double w : speeds) {
      EXPECT_NEAR((whirl_poles(r, w).array() - Complex(0, w)).abs().minCoeff(), 0, 1e-6 * w);
    }
  }
}

TEST(GyroscopicReference, WithoutCouplingItIsTheTwoDegreeRotor) {
  GyroscopicRotor r = overhung();
  r.shaft.k12 = 0;
  r.cubic = 1e7;
  RotorModel m;
  m.k1 = r.shaft.k11 / r.mass;
  m.k2 = r.cubic / r.mass;
  m.c = r.damping / r.mass;
  m.eps = r.eps;
  const AngleSignal angle = angle_signal(SpeedProfile::run_down(300, 5), 0.5e-3);
  const GyroscopicResponse a = simulate(r, angle);
  const Response b = simulate(m, angle, a.z[0], a.dz[0]);
  EXPECT_NEAR((a.z - b.z).cwiseAbs().maxCoeff() / b.peak_radius(), 0, 1e-12);
}

TEST(GyroscopicReference, ConstantSpeedKeepsTheSteadyResponse) {
  const GyroscopicRotor r = overhung();
  SpeedProfile p;
  p.omega_start = p.omega_end = 150;
  const AngleSignal angle = angle_signal(p, 0.1e-3, 5001);
  const GyroscopicResponse out = simulate(r, angle);
  const Eigen::Vector2cd steady = steady_unbalance(r, 150);
  const Complex back = std::polar(1.0, -angle.beta[10000]);
  EXPECT_NEAR(std::abs(out.z[5000] * back - steady[0]) / std::abs(steady[0]), 0, 1e-6);
  EXPECT_NEAR(std::abs(out.psi[5000] * back - steady[1]) / std::abs(steady[1]), 0, 1e-6);
}

TEST(GyroscopicConvergence, OrderIsFour) {
  const GyroscopicRotor r = overhung();
  const SpeedProfile p = SpeedProfile::run_up(200, 3);
  const auto end = [&](Eigen::Index steps) {
    return simulate(r, angle_signal(p, 2.0 / static_cast<double>(steps), steps + 1)).z[steps];
  };
  const Complex truth = end(64000);
  EXPECT_NEAR(std::log2(std::abs(end(4000) - truth) / std::abs(end(8000) - truth)), 4.0, 0.1);
}

TEST(GyroscopicProperty, GyroscopicMomentDoesNoWork) {
  GyroscopicRotor r = overhung();
  r.damping = r.tilt_damping = 0;
  // A quick change of speed leaves a free motion beside the steady response: its energy is conserved.
  SpeedProfile p;
  p.omega_start = 280;
  p.omega_end = 250;
  p.ramp_time = 0.05;
  p.dwell_end = 1;
  const AngleSignal angle = angle_signal(p, 0.05e-3);
  const GyroscopicResponse out = simulate(r, angle);
  const Eigen::Vector2cd steady = steady_unbalance(r, 250);
  const auto energy = [&](Eigen::Index i) {
    const Complex e = std::polar(1.0, angle.beta[2 * i]), turn(0, 250);
    const Complex z = out.z[i] - steady[0] * e, psi = out.psi[i] - steady[1] * e;
    const Complex dz = out.dz[i] - turn * steady[0] * e, dpsi = out.dpsi[i] - turn * steady[1] * e;
    return r.mass * std::norm(dz) + r.diametral * std::norm(dpsi) + r.shaft.k11 * std::norm(z) +
           r.shaft.k22 * std::norm(psi) + 2 * r.shaft.k12 * (z * std::conj(psi)).real();
  };
  EXPECT_GT(energy(2000), 1e-8);  // J, far above rounding
  for (Eigen::Index i : {5000, 10000, 20000}) EXPECT_NEAR(energy(i) / energy(2000), 1.0, 1e-6);
}

TEST(Gyroscopic, RejectsAnImpossibleBody) {
  GyroscopicRotor r = overhung();
  r.polar = 3 * r.diametral;
  EXPECT_THROW(whirl_poles(r, 0), Error);
}

}  // namespace
}  // namespace whirl::rotor
