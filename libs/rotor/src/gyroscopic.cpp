// g++ 12 reports its own AVX-512 header as reading an uninitialised value when Eigen multiplies complex
// numbers.
#pragma GCC diagnostic ignored "-Wuninitialized"
#include "whirl/rotor/gyroscopic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/rotor/equations.hpp"

namespace whirl::rotor {

namespace {

using Complex = std::complex<double>;

void check(const GyroscopicRotor& r) {
  require_range("mass", r.mass, 1e-12, 1e9, "kg");
  require_range("diametral", r.diametral, 1e-12, 1e9, "kg m^2");
  require_range("polar", r.polar, 0, 2 * r.diametral, "kg m^2");  // a rigid body: Ip <= 2 Id
}

}  // namespace

ShaftStiffness ShaftStiffness::cantilever(double ei, double length) {
  require_range("length", length, 1e-6, 1e3, "m");
  return {12 * ei / (length * length * length), -6 * ei / (length * length), 4 * ei / length};
}

ShaftStiffness ShaftStiffness::hinged(double ei, double a, double b) {
  require_range("a", a, 1e-6, 1e3, "m");
  require_range("b", b, 1e-6, 1e3, "m");
  const double scale = 3 * ei * (a + b);
  Eigen::Matrix2d flexibility;
  flexibility << a * a * b * b, a * b * (b - a), a * b * (b - a), a * a - a * b + b * b;
  const Eigen::Matrix2d k = scale * flexibility.inverse();
  return {k(0, 0), k(0, 1), k(1, 1)};
}

Eigen::Vector4cd whirl_poles(const GyroscopicRotor& r, double omega) {
  check(r);
  Eigen::Matrix4cd a = Eigen::Matrix4cd::Zero();  // (z, psi, z', psi')
  a(0, 2) = a(1, 3) = 1;
  a(2, 0) = -r.shaft.k11 / r.mass;
  a(2, 1) = -r.shaft.k12 / r.mass;
  a(2, 2) = -r.damping / r.mass;
  a(3, 0) = -r.shaft.k12 / r.diametral;
  a(3, 1) = -r.shaft.k22 / r.diametral;
  a(3, 3) = Complex(-r.tilt_damping, r.polar * omega) / r.diametral;
  Eigen::Vector4cd poles = Eigen::ComplexEigenSolver<Eigen::MatrixXcd>(Eigen::MatrixXcd(a), false).eigenvalues();
  std::sort(poles.begin(), poles.end(), [](Complex p, Complex q) { return p.imag() < q.imag(); });
  return poles;
}

// det(K - w^2 diag(m, Id - Ip)) = 0.
std::vector<double> critical_speeds(const GyroscopicRotor& r) {
  check(r);
  const double d = r.diametral - r.polar;
  const double a = r.mass * d, b = -(r.mass * r.shaft.k22 + d * r.shaft.k11);
  const double c = r.shaft.k11 * r.shaft.k22 - r.shaft.k12 * r.shaft.k12;
  std::vector<double> speeds;
  const auto add = [&](double w2) {
    if (w2 > 0 && std::isfinite(w2)) speeds.push_back(std::sqrt(w2));
  };
  // Stable form of the quadratic formula; a = 0 (Ip = Id) leaves the root c / q.
  const double q = -0.5 * (b + std::copysign(std::sqrt(std::max(0.0, b * b - 4 * a * c)), b));
  if (q != 0) add(c / q);
  if (a != 0) add(q / a);
  std::sort(speeds.begin(), speeds.end());
  return speeds;
}

Eigen::Vector2cd steady_unbalance(const GyroscopicRotor& r, double omega) {
  check(r);
  const double w2 = omega * omega, d = r.diametral - r.polar;
  Eigen::Matrix2cd dynamic;
  dynamic << Complex(r.shaft.k11 - r.mass * w2, r.damping * omega), r.shaft.k12, r.shaft.k12,
      Complex(r.shaft.k22 - d * w2, r.tilt_damping * omega);
  return dynamic.partialPivLu().solve(Eigen::Vector2cd(r.mass * r.eps * w2, d * r.chi * w2));
}

GyroscopicResponse simulate(const GyroscopicRotor& r, const AngleSignal& angle) {
  check(r);
  if (!(angle.dt > 0) || angle.beta.size() % 2 == 0) {
    throw Error::in_field("angle", fmt::format("{} entries, dt = {:g} s", angle.beta.size(), angle.dt),
                          "2 N - 1 entries with dt above 0");
  }
  using State = Eigen::Vector4cd;  // (z, psi, z', psi')
  const Eigen::VectorXcd forcing = unbalance_forcing(angle);
  const double d = r.diametral - r.polar;
  Eigen::Index base = 0;
  const auto rate = [&](double half_steps, const State& s) {
    const Eigen::Index i = base + std::lround(half_steps);
    const Complex f = forcing[i];
    const Complex ddz = (r.mass * r.eps * f - r.damping * s[2] - (r.shaft.k11 + r.cubic * std::norm(s[0])) * s[0] -
                         r.shaft.k12 * s[1]) /
                        r.mass;
    const Complex ddpsi = (d * r.chi * f + Complex(-r.tilt_damping, r.polar * angle.omega[i]) * s[3] -
                           r.shaft.k12 * s[0] - r.shaft.k22 * s[1]) /
                          r.diametral;
    return State(State(s[2], s[3], ddz, ddpsi) * (0.5 * angle.dt));
  };
  const Complex turn(0, angle.omega[0]), start = std::polar(1.0, angle.beta[0]);
  const Eigen::Vector2cd steady = steady_unbalance(r, angle.omega[0]);
  State s(steady[0] * start, steady[1] * start, turn * steady[0] * start, turn * steady[1] * start);
  const Eigen::Index n = angle.samples();
  GyroscopicResponse out{angle.dt, Eigen::VectorXcd(n), Eigen::VectorXcd(n), Eigen::VectorXcd(n), Eigen::VectorXcd(n)};
  for (Eigen::Index k = 0; k < n; ++k) {
    out.z[k] = s[0];
    out.psi[k] = s[1];
    out.dz[k] = s[2];
    out.dpsi[k] = s[3];
    base = 2 * k;
    if (k + 1 < n) s = rk4_step(rate, 0.0, s, 2.0);  // in half samples
  }
  return out;
}

}  // namespace whirl::rotor
