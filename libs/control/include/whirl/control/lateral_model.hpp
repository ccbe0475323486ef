#pragma once
#include <cmath>
#include <complex>
#include <numbers>

#include "whirl/core/rotor_model.hpp"

namespace whirl::control {

/// The state part of a RotorModel as a fixed-size value for the real-time path; z = x + i y about the
/// equilibrium.
struct LateralModel {
  double k1 = 0, k2 = 0, c = 0;
  std::complex<double> k1_conj, c_conj;

  static LateralModel from(const RotorModel& m) { return {m.k1, m.k2, m.c, m.k1_conj, m.c_conj}; }

  /// Acceleration without control and unbalance. `stiffness` scales k1 and k1_conj: the part of the linear
  /// stiffness a law cancels. Real arithmetic, because the product of two std::complex tests for NaN.
  std::complex<double> acceleration(std::complex<double> z, std::complex<double> v,
                                    double stiffness = 1) const noexcept {
    const double x = z.real(), y = z.imag(), vx = v.real(), vy = v.imag();
    const double k = stiffness * k1 + k2 * (x * x + y * y);
    const double kr = stiffness * k1_conj.real(), ki = stiffness * k1_conj.imag();
    const double cr = c_conj.real(), ci = c_conj.imag();
    return {-k * x - c * vx - kr * x - ki * y - cr * vx - ci * vy,
            -k * y - c * vy + kr * y - ki * x + cr * vy - ci * vx};
  }
};

/// a b without the NaN test of std::complex.
inline std::complex<double> product(std::complex<double> a, std::complex<double> b) noexcept {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
/// e^{i angle} to rounding. With fused multiply-add the angle is taken from the nearest quarter turn (exact: pi / 2 in
/// two parts) and the rest by its series, which stays inside the caller's vector registers.
inline std::complex<double> unit_phasor(double angle) noexcept {
#ifdef __FMA__
  constexpr double kTurns = 2 / std::numbers::pi, kQuarter = 0x1.921fb54442d18p0, kRest = 0x1.1a62633145c07p-54;
  if (std::abs(angle) < 1e6) {
    const double turns = std::nearbyint(angle * kTurns);
    const double r = std::fma(-turns, kRest, std::fma(-turns, kQuarter, angle)), s = r * r;
    // Taylor's series up to r^16 and r^17: 1e-18 at an eighth of a turn.
    const auto part = [s](int n, double rest) { return 1 - s * (1.0 / (n * (n + 1))) * rest; };
    const double c = part(1, part(3, part(5, part(7, part(9, part(11, part(13, part(15, 1))))))));
    const double d = r * part(2, part(4, part(6, part(8, part(10, part(12, part(14, part(16, 1))))))));
    const auto quarter = static_cast<int>(turns) & 3;
    const double re = (quarter & 1) != 0 ? d : c, im = (quarter & 1) != 0 ? c : d;
    return {quarter == 1 || quarter == 2 ? -re : re, quarter >= 2 ? -im : im};
  }
#endif
  return {std::cos(angle), std::sin(angle)};
}
/// e^{i beta} (omega^2 - i alpha): unbalance acceleration per metre of eccentricity; `turn` is e^{i beta}.
inline std::complex<double> unbalance_per_metre(std::complex<double> turn, double omega, double alpha) noexcept {
  return product(turn, {omega * omega, -alpha});
}
inline std::complex<double> unbalance_per_metre(double beta, double omega, double alpha) noexcept {
  return unbalance_per_metre(unit_phasor(beta), omega, alpha);
}

/// Position, velocity and disturbance acceleration of the disk.
struct DiskMotion {
  std::complex<double> z;  ///< m
  std::complex<double> v;  ///< m/s
  std::complex<double> d;  ///< m/s^2, synchronous: turns with the rotor
};

/// Explicit midpoint step of length dt under the held control acceleration `a`; the disturbance turns by `half` in each
/// half of it.
inline DiskMotion predict_motion(const LateralModel& model, const DiskMotion& s, std::complex<double> a,
                                 std::complex<double> half, double dt) noexcept {
  const std::complex<double> d_mid = product(s.d, half);
  const std::complex<double> a0 = model.acceleration(s.z, s.v) + s.d + a;
  const std::complex<double> z_mid = s.z + 0.5 * dt * s.v, v_mid = s.v + 0.5 * dt * a0;
  const std::complex<double> a_mid = model.acceleration(z_mid, v_mid) + d_mid + a;
  return {s.z + dt * v_mid, s.v + dt * a_mid, product(d_mid, half)};
}
/// The same; the disturbance turns at omega.
inline DiskMotion predict_motion(const LateralModel& model, const DiskMotion& s, std::complex<double> a, double omega,
                                 double dt) noexcept {
  return predict_motion(model, s, a, unit_phasor(0.5 * omega * dt), dt);
}

}  // namespace whirl::control
