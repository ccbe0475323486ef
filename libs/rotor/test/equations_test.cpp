#include "whirl/rotor/equations.hpp"

#include <gtest/gtest.h>

#include <random>

#include "energy.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::rotor {
namespace {

UnbalancedDisk disk() {
  UnbalancedDisk d;
  d.mass = 1.5;
  d.inertia = 0.004;
  d.stiffness = 8500;
  d.cubic = 1.5e7;
  d.damping_x = 1.6;
  d.damping_y = 1.4;
  d.eccentricity = 5e-3;  // large, so that the coupling counts
  d.phase = 0.7;
  return d;
}

DiskState random_state(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  return {5e-3 * u(random), 0.5 * u(random), 5e-3 * u(random), 0.5 * u(random), 3 * u(random), 100 * u(random)};
}

// Lagrange's equations as a 3 x 3 system from T = m |V_G|^2 / 2 + J_bar b'^2 / 2, solved numerically.
Eigen::Vector3d by_mass_matrix(const UnbalancedDisk& d, const DiskState& s, double ux, double uy, double tau) {
  const double me = d.mass * d.eccentricity, b = s.beta + d.phase, w2 = s.omega * s.omega;
  Eigen::Matrix3d m;
  m << d.mass, 0, -me * std::sin(b), 0, d.mass, me * std::cos(b), -me * std::sin(b), me * std::cos(b), d.inertia;
  EXPECT_NEAR(m.determinant(), d.mass * d.mass * d.inertia_about_g(), 1e-12);
  const double k = d.stiffness + d.cubic * (s.x * s.x + s.y * s.y);
  const Eigen::Vector3d q(ux - k * s.x - d.damping_x * s.dx + me * w2 * std::cos(b),
                          uy - k * s.y - d.damping_y * s.dy + me * w2 * std::sin(b), tau);
  return m.lu().solve(q);
}

TEST(LagrangeProperty, AgreesWithTheMassMatrixForm) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 50; ++i) {
    const DiskState s = random_state(random);
    const DiskAcceleration a = lagrange_acceleration(disk(), s, 3, -2, 0.4);
    const Eigen::Vector3d expected = by_mass_matrix(disk(), s, 3, -2, 0.4);
    EXPECT_NEAR(a.ddx, expected[0], 1e-9 * expected.norm());
    EXPECT_NEAR(a.ddy, expected[1], 1e-9 * expected.norm());
    EXPECT_NEAR(a.alpha, expected[2], 1e-9 * expected.norm());
  }
}

TEST(LagrangeProperty, ComplexModelIsTheSameWhenTheAngleIsPrescribed) {
  std::mt19937_64 random(8);
  const RotorModel model = disk().rotor_model();
  for (int i = 0; i < 50; ++i) {
    const DiskState s = random_state(random);
    const DiskAcceleration a = lagrange_acceleration(disk(), s, 3, -2, 0.4);
    const std::complex<double> ddz =
        lateral_acceleration(model, {s.x, s.y}, {s.dx, s.dy}, unbalance_forcing(s.beta, s.omega, a.alpha), {3, -2});
    EXPECT_NEAR(ddz.real(), a.ddx, 1e-9 * std::abs(ddz));
    EXPECT_NEAR(ddz.imag(), a.ddy, 1e-9 * std::abs(ddz));
  }
}

TEST(LagrangeProperty, PowerOfTheForcesIsTheRateOfEnergy) {
  std::mt19937_64 random(9);
  const UnbalancedDisk d = disk();
  for (int i = 0; i < 50; ++i) {
    const DiskState s = random_state(random);
    const double ux = 3, uy = -2, tau = 0.4, h = 1e-6;
    const DiskAcceleration a = lagrange_acceleration(d, s, ux, uy, tau);
    const auto moved = [&](double t) {
      return DiskState{s.x + t * s.dx,   s.dx + t * a.ddx,     s.y + t * s.dy,
                       s.dy + t * a.ddy, s.beta + t * s.omega, s.omega + t * a.alpha};
    };
    const double rate = (mechanical_energy(d, moved(h)) - mechanical_energy(d, moved(-h))) / (2 * h);
    const double power = ux * s.dx + uy * s.dy + tau * s.omega - d.damping_x * s.dx * s.dx - d.damping_y * s.dy * s.dy;
    EXPECT_NEAR(rate, power, 1e-4 * (1 + std::abs(power)));
  }
}

TEST(LateralAcceleration, AnisotropyActsOnTheConjugate) {
  RotorModel m;
  m.k1 = 100;
  m.k1_conj = {2, 3};
  m.c = 5;
  m.c_conj = {0.5, 0.25};
  m.k2 = 1000;
  m.eps = {1e-3, 2e-3};
  const std::complex<double> z(0.1, -0.2), dz(0.3, 0.4), f(50, 60);
  const std::complex<double> expected =
      -m.k1 * z - m.k1_conj * std::conj(z) - m.k2 * std::norm(z) * z - m.c * dz - m.c_conj * std::conj(dz) + m.eps * f;
  const std::complex<double> a = lateral_acceleration(m, z, dz, f);
  EXPECT_NEAR(a.real(), expected.real(), 1e-12);
  EXPECT_NEAR(a.imag(), expected.imag(), 1e-12);
}

}  // namespace
}  // namespace whirl::rotor
