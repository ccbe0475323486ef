#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rotor {

namespace {

using Complex = std::complex<double>;

// Smallest A >= 0 with A ((d + k A)^2 + g^2) = level: squared amplitude of an isotropic rotor.
double smallest_amplitude2(double d, double k, double g, double level) {
  const auto excess = [&](double a) { return a * ((d + k * a) * (d + k * a) + g * g) - level; };
  // The cubic turns where 3 k^2 A^2 + 4 d k A + d^2 + g^2 = 0; the smallest root is before its first maximum,
  // if that is high enough, else behind the minimum.
  double low = 0, high = 0;
  const double discriminant = d * d - 3 * g * g;
  if (k != 0 && discriminant > 0 && d * k < 0) {
    const double a1 = (-2 * d * k - std::abs(k) * std::sqrt(discriminant)) / (3 * k * k);
    const double a2 = (-2 * d * k + std::abs(k) * std::sqrt(discriminant)) / (3 * k * k);
    (excess(a1) >= 0 ? high : low) = excess(a1) >= 0 ? a1 : a2;
  }
  if (high == 0) {
    high = std::max(2 * low, level / std::max(d * d + g * g, 1e-300));
    while (excess(high) < 0 && std::isfinite(high)) high *= 2;
  }
  for (int i = 0; i < 200 && high > low; ++i) {
    const double middle = 0.5 * (low + high);
    if (middle == low || middle == high) break;
    (excess(middle) < 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

// With z = Z_f e^{i b} + conj(W) e^{-i b}, harmonic balance gives
//   (D + k2 (|Z_f|^2 + 2 |W|^2)) Z_f + (k1_conj + i Omega c_conj) W = eps Omega^2
//   (conj(k1_conj) + i Omega conj(c_conj)) Z_f + (D + k2 (|W|^2 + 2 |Z_f|^2)) W = 0,  D = k1 - Omega^2 + i c
//   Omega.
WhirlState steady_whirl(const RotorModel& m, double omega, double beta) {
  if (omega == 0) return {};
  const Complex d(m.k1 - omega * omega, m.c * omega), i_omega(0, omega), level = m.eps * omega * omega;
  const Complex cf = m.k1_conj + i_omega * m.c_conj, cb = std::conj(m.k1_conj) + i_omega * std::conj(m.c_conj);
  const double a2 = smallest_amplitude2(d.real(), m.k2, d.imag(), std::norm(level));
  Complex zf = level / (d + m.k2 * a2), w = 0;
  const auto residual = [&](const Eigen::Vector4d& u) {
    const Complex f(u[0], u[1]), b(u[2], u[3]);
    const Complex r1 = (d + m.k2 * (std::norm(f) + 2 * std::norm(b))) * f + cf * b - level;
    const Complex r2 = cb * f + (d + m.k2 * (std::norm(b) + 2 * std::norm(f))) * b;
    return Eigen::Vector4d(r1.real(), r1.imag(), r2.real(), r2.imag());
  };
  if (cf != 0.0 || cb != 0.0) {
    Eigen::Vector4d u(zf.real(), zf.imag(), 0, 0);
    for (int iteration = 0; iteration < 30; ++iteration) {
      const Eigen::Vector4d r = residual(u);
      Eigen::Matrix4d jacobian;
      const double step = 1e-6 * std::max(u.norm(), 1e-12);
      for (int j = 0; j < 4; ++j) {
        const Eigen::Vector4d e = Eigen::Vector4d::Unit(j) * step;
        jacobian.col(j) = (residual(u + e) - residual(u - e)) / (2 * step);
      }
      const Eigen::Vector4d change = jacobian.fullPivLu().solve(r);
      if (!change.allFinite()) break;
      u -= change;
      if (change.norm() <= 1e-12 * u.norm()) break;
    }
    zf = Complex(u[0], u[1]);
    w = Complex(u[2], u[3]);
  }
  const Complex forward = zf * std::polar(1.0, beta), backward = std::conj(w) * std::polar(1.0, -beta);
  return {forward + backward, i_omega * (forward - backward)};
}

}  // namespace whirl::rotor
