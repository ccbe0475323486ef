#include "whirl/diagnosis/rotor_influence.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;
using Eigen::Vector2d;

/// 1X vector at `probe` of a disk on springs and dampers along x and y with coupling, written in real coordinates and
/// integrated until it is steady: shares nothing with the complex model but the machine.
Complex integrated(double kx, double ky, double kxy, double cx, double cy, double speed, Complex eccentricity,
                   double probe) {
  constexpr int kSteps = 400, kTurns = 400;
  const double h = kTwoPi / speed / kSteps;
  Vector2d q(0, 0), v(0, 0);
  const auto pull = [&](double t, const Vector2d& x, const Vector2d& dx) -> Vector2d {
    const Complex f = eccentricity * speed * speed * std::polar(1.0, speed * t);
    return {f.real() - kx * x[0] - kxy * x[1] - cx * dx[0], f.imag() - ky * x[1] - kxy * x[0] - cy * dx[1]};
  };
  Complex vector = 0;
  for (int k = 0; k < kSteps * kTurns; ++k) {
    const double t = k * h;
    if (k >= kSteps * (kTurns - 1))
      vector += 2.0 / kSteps * (q[0] * std::cos(probe) + q[1] * std::sin(probe)) * std::polar(1.0, -speed * t);
    const Vector2d a1 = pull(t, q, v), q2 = q + h / 2 * v, v2 = v + h / 2 * a1, a2 = pull(t + h / 2, q2, v2);
    const Vector2d q3 = q + h / 2 * v2, v3 = v + h / 2 * a2, a3 = pull(t + h / 2, q3, v3), q4 = q + h * v3,
                   v4 = v + h * a3, a4 = pull(t + h, q4, v4);
    q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  return vector;
}

TEST(RotorInfluenceReference, EqualsAnIntegratedAnisotropicDisk) {
  const double kx = 7000, ky = 5200, kxy = 600, cx = 9, cy = 5;
  RotorModel rotor;
  rotor.k1 = 0.5 * (kx + ky);
  rotor.k1_conj = Complex(0.5 * (kx - ky), kxy);
  rotor.c = 0.5 * (cx + cy);
  rotor.c_conj = 0.5 * (cx - cy);
  RotorReadings r{.mass = 1.6, .radius = 0.08, .mark = 0.7};
  for (const double speed : {40.0, 74.0, 79.0, 120.0})
    for (const double probe : {0.0, std::numbers::pi / 2, std::numbers::pi / 4}) {
      r.speed.push_back(speed);
      r.probe.push_back(probe);
    }
  const Eigen::VectorXcd found = rotor_influence(rotor, r);
  for (Eigen::Index m = 0; m < found.size(); ++m) {
    const auto i = static_cast<std::size_t>(m);
    const Complex exact =
        integrated(kx, ky, kxy, cx, cy, r.speed[i], std::polar(r.radius / r.mass, r.mark), r.probe[i]);
    EXPECT_LT(std::abs(found[m] - exact), 1e-4 * std::abs(exact)) << r.speed[i] << " rad/s, probe " << r.probe[i];
  }
}

TEST(RotorInfluence, ThePriorIsAsWideAsTheModelIsUncertain) {
  RotorModel rotor;
  rotor.k1 = 6000;
  rotor.c = 8;
  rotor.k2 = 1e8;
  const RotorReadings r{.mass = 1.5, .radius = 0.08, .speed = {60, 60, 90}, .probe = {0, kTwoPi / 4, 0}};
  std::vector<double> covariance(25, 0);
  covariance[0] = 60 * 60;
  covariance[2 * 5 + 2] = 1;
  Summary warnings;
  const InfluencePrior narrow = rotor_prior(rotor, {}, r, 0, 0.01, warnings),
                       wide = rotor_prior(rotor, covariance, r, 0, 0.01, warnings);
  EXPECT_TRUE(warnings.warnings.empty());
  wide.check(3, 1);
  const Eigen::VectorXcd mean = rotor_influence(rotor, r);
  for (Eigen::Index m = 0; m < 3; ++m) {
    // First order: da/a = -(dk + i w dc) / (k - w^2 + i c w).
    const double w = r.speed[static_cast<std::size_t>(m)],
                 expected = std::sqrt(60 * 60 + w * w) / std::abs(Complex(6000 - w * w, 8 * w)) * std::abs(mean[m]);
    const double extra = (wide.covariance(m, m) - narrow.covariance(m, m)).real();
    EXPECT_NEAR(std::sqrt(extra) / expected, 1, 0.15) << m;
  }
  // Both probes see one rotor: their errors are one.
  const double together = std::abs(wide.covariance(0, 1) - narrow.covariance(0, 1)),
               alone = (wide.covariance(0, 0) - narrow.covariance(0, 0)).real();
  EXPECT_GT(together, 0.99 * alone);
  // Large motion on a hardening shaft: said, once.
  RotorReadings large = r;
  large.amplitude = 6e-3;
  rotor_prior(rotor, covariance, large, 0, 0.01, warnings);
  EXPECT_EQ(warnings.warnings.size(), 1U);
  EXPECT_THROW(rotor_influence(rotor, {.radius = 0.08, .speed = {60}, .probe = {0}}), Error);
  EXPECT_THROW(rotor_influence(rotor, {.mass = 1, .radius = 0.08, .speed = {0}, .probe = {0}}), Error);
  EXPECT_THROW(rotor_influence(rotor, {.mass = 1, .radius = 0.08, .speed = {60}, .probe = {}}), Error);
}

}  // namespace
}  // namespace whirl::diagnosis
