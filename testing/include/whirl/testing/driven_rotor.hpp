#pragma once
#include <Eigen/Core>
#include <cmath>
#include <random>
#include <string>

#include "whirl/core/recording.hpp"

/// A disk on a nonlinear shaft turned by a motor, from Lagrange's equations with their mass matrix.
namespace whirl::testing {

struct DrivenRotor {
  double m = 1.2, inertia = 4e-3;  ///< kg; kg m^2 about the centre of mass
  double k1 = 1.2 * 6400, k2 = 1.2 * 6e8, c = 1.2 * 6;
  double e = 2.5e-4, phase = 0.7;
  double motor = 0.2, slope = 6e-4, coulomb = 0.02, viscous = 3e-4, drag = 1.5e-6;  ///< N m, N m s, N m s^2

  /// M(q) q'' = Q(q, q') for q = x, y, beta at drive u.
  Eigen::Vector3d accelerations(const Eigen::Matrix<double, 6, 1>& s, double u) const {
    const double b = s[4] + phase, n = s[5], r2 = s[0] * s[0] + s[2] * s[2];
    double torque = -viscous * n - drag * n * std::abs(n) - coulomb * ((n > 0) - (n < 0));
    if (u != 0) torque += motor * u - slope * n;
    const Eigen::Vector3d force(-k1 * s[0] - k2 * r2 * s[0] - c * s[1] + m * e * n * n * std::cos(b),
                                -k1 * s[2] - k2 * r2 * s[2] - c * s[3] + m * e * n * n * std::sin(b), torque);
    // M = [m, 0, p; 0, m, q; p, q, inertia + m e^2]: x'' and y'' from the first two rows into the third, where
    // p^2 + q^2 = m^2 e^2 leaves the inertia.
    const double p = -m * e * std::sin(b), q = m * e * std::cos(b);
    const double turning = (force[2] - (p * force[0] + q * force[1]) / m) / inertia;
    return {(force[0] - p * turning) / m, (force[1] - q * turning) / m, turning};
  }
};

/// Channels x, y (noise of `noise_share` times their spread), beta (2 mrad of noise) and drive.
inline Recording driven_record(const DrivenRotor& rotor, const Eigen::VectorXd& drive, double dt, double speed,
                               double noise_share, unsigned seed, double* top = nullptr) {
  using State = Eigen::Matrix<double, 6, 1>;
  const int fine = 4;
  const double h = dt / fine;
  State s = State::Zero();
  s[5] = speed;
  const auto rate = [&](const State& at, double u) {
    const Eigen::Vector3d a = rotor.accelerations(at, u);
    State r;
    r << at[1], a[0], at[3], a[1], at[5], a[2];
    return r;
  };
  Eigen::MatrixXd out(drive.size(), 3);
  for (Eigen::Index i = 0; i < drive.size(); ++i) {
    out.row(i) << s[0], s[2], s[4];
    if (top != nullptr) *top = std::max(*top, s[5]);
    for (int j = 0; j < fine; ++j) {
      const double u = drive[i];
      const State a = rate(s, u), b = rate(s + 0.5 * h * a, u), c = rate(s + 0.5 * h * b, u), d = rate(s + h * c, u);
      s += h / 6 * (a + 2 * (b + c) + d);
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  Recording r;
  r.dt = dt;
  r.source = "driven rotor";
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXd y = out.col(k);
    const double sd = k == 2 ? 2e-3 : noise_share * std::sqrt((y.array() - y.mean()).square().mean());
    for (double& v : y) v += sd * gauss(random);
    r.add(k == 0 ? "x" : k == 1 ? "y" : "beta", k == 2 ? Quantity::angle : Quantity::displacement, y);
  }
  r.add("drive", Quantity::dimensionless, drive);
  return r;
}

}  // namespace whirl::testing
