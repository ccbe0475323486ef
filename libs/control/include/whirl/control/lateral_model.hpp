#pragma once
#include <array>
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
    const double hardening = k2 * (x * x + y * y), k_across = stiffness * k1_conj.imag(), c_across = c_conj.imag();
    const double kx = stiffness * (k1 + k1_conj.real()), ky = stiffness * (k1 - k1_conj.real());
    // Two short sums that do not wait for one another.
    return {(-kx * x - k_across * y - hardening * x) - ((c + c_conj.real()) * vx + c_across * vy),
            (-ky * y - k_across * x - hardening * y) - ((c - c_conj.real()) * vy + c_across * vx)};
  }
};

/// a b without the NaN test of std::complex.
inline std::complex<double> product(std::complex<double> a, std::complex<double> b) noexcept {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}
/// Both axes side by side in one vector register.
typedef double Axes __attribute__((vector_size(2 * sizeof(double))));
inline constexpr auto kFactorial = [] {
  std::array<double, 18> out{1};
  for (std::size_t n = 1; n < out.size(); ++n) out[n] = out[n - 1] * static_cast<double>(n);
  return out;
}();
/// e^{i angle} to rounding. With fused multiply-add the angle is taken from the nearest quarter turn (exact: pi / 2 in
/// two parts) and the rest by its series, which stays inside the caller's vector registers.
[[gnu::always_inline]] inline std::complex<double> unit_phasor(double angle) noexcept {
#ifdef __FMA__
  constexpr double kTurns = 2 / std::numbers::pi, kQuarter = 0x1.921fb54442d18p0, kRest = 0x1.1a62633145c07p-54;
  if (std::abs(angle) < 1e6) {
    const double turns = std::nearbyint(angle * kTurns);
    const double r = std::fma(-turns, kRest, std::fma(-turns, kQuarter, angle)), s = r * r;
    // Taylor's series up to r^16 and r^17, cosine and sine side by side: 1e-18 at an eighth of a turn.
    const Axes square{s, s};
    Axes sum{1.0 / kFactorial[16], 1.0 / kFactorial[17]};
#pragma GCC unroll 8
    for (int n = 7; n >= 0; --n) {
      const double sign = n % 2 == 0 ? 1 : -1;
      sum = sum * square + Axes{sign / kFactorial[2 * n], sign / kFactorial[2 * n + 1]};
    }
    const double c = sum[0], d = r * sum[1];
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

[[gnu::always_inline]] inline Axes axes(std::complex<double> z) noexcept { return Axes{z.real(), z.imag()}; }
[[gnu::always_inline]] inline Axes crossed(const Axes& a) noexcept { return Axes{a[1], a[0]}; }

/// Explicit midpoint steps of a model, the motion in registers from one to the next.
class MotionPrediction {
 public:
  [[gnu::always_inline]] MotionPrediction(const LateralModel& m, const DiskMotion& s) noexcept
      : k_{m.k1 + m.k1_conj.real(), m.k1 - m.k1_conj.real()},
        c_{m.c + m.c_conj.real(), m.c - m.c_conj.real()},
        k_across_{m.k1_conj.imag(), m.k1_conj.imag()},
        c_across_{m.c_conj.imag(), m.c_conj.imag()},
        k2_(m.k2),
        z_(axes(s.z)),
        v_(axes(s.v)),
        d_(axes(s.d)) {}

  /// One of length dt under the held control acceleration; the disturbance turns by `half` in each half of it.
  [[gnu::always_inline]] void step(std::complex<double> acceleration, std::complex<double> half, double dt) noexcept {
    const Axes a = axes(acceleration), along{half.real(), half.real()}, aside{-half.imag(), half.imag()};
    const Axes d_mid = along * d_ + aside * crossed(d_);
    const Axes z_mid = z_ + 0.5 * dt * v_;
    // What the velocity takes comes last: it is known last.
    const Axes v_mid = v_ + 0.5 * dt * ((elastic(z_) + (d_ + a)) - damping(v_));
    z_ += dt * v_mid;
    v_ += dt * ((elastic(z_mid) + (d_mid + a)) - damping(v_mid));
    d_ = along * d_mid + aside * crossed(d_mid);
  }
  [[gnu::always_inline]] DiskMotion motion() const noexcept { return {{z_[0], z_[1]}, {v_[0], v_[1]}, {d_[0], d_[1]}}; }

 private:
  [[gnu::always_inline]] Axes elastic(const Axes& z) const noexcept {
    const Axes square = z * z;
    return -k_ * z - k_across_ * crossed(z) - (k2_ * (square + crossed(square))) * z;
  }
  [[gnu::always_inline]] Axes damping(const Axes& v) const noexcept { return c_ * v + c_across_ * crossed(v); }

  Axes k_, c_, k_across_, c_across_;
  double k2_;
  Axes z_, v_, d_;
};

/// Explicit midpoint step of length dt under the held control acceleration `a`; the disturbance turns by `half` in each
/// half of it.
inline DiskMotion predict_motion(const LateralModel& model, const DiskMotion& s, std::complex<double> a,
                                 std::complex<double> half, double dt) noexcept {
  MotionPrediction p(model, s);
  p.step(a, half, dt);
  return p.motion();
}
/// The same; the disturbance turns at omega.
inline DiskMotion predict_motion(const LateralModel& model, const DiskMotion& s, std::complex<double> a, double omega,
                                 double dt) noexcept {
  return predict_motion(model, s, a, unit_phasor(0.5 * omega * dt), dt);
}

}  // namespace whirl::control
