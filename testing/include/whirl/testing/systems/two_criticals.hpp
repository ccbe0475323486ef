#pragma once
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "whirl/testing/machines.hpp"

/// A rotor with two critical speeds, made apart from the code under test: Machine, and a second bending mode that the
/// same unbalance forces and that the probes see beside it. Real coordinates, Dormand-Prince steps.
namespace whirl::testing {

struct TwoCriticals {
  Machine first;
  double w = 0, zeta = 0;       ///< of the second mode, rad/s and damping ratio
  double share = 0, phase = 0;  ///< its unbalance as the probes weigh it, m and rad
};

/// Critical speeds of 11 to 14 Hz and 2.2 to 3 times as much, damping of 1 to 3 %.
inline TwoCriticals draw_two_criticals(unsigned long long seed) {
  std::mt19937_64 random(seed * 48271 + 11);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  TwoCriticals t;
  const double w = 2 * std::numbers::pi * uniform(11, 14);
  t.first.k = w * w;
  t.first.c = 2 * uniform(0.015, 0.03) * w;
  t.first.cubic = uniform(0.05, 0.15) * t.first.k / 9e-6;
  t.first.e = uniform(4e-5, 8e-5);
  t.first.e_phase = uniform(-3, 3);
  t.w = uniform(2.2, 3) * w;
  t.zeta = uniform(0.01, 0.03);
  t.share = uniform(0.4, 1) * t.first.e;
  t.phase = uniform(-3, 3);
  return t;
}

namespace two_criticals_detail {

using machines_detail::State;

/// x, x', y, y' of the first mode and of the second.
inline State slope(const TwoCriticals& t, double beta, double w, double a, const State& s) {
  State d = machines_detail::slope(t.first, 0, beta, w, a, s);
  const double at = t.phase + beta, square = w * w;
  d[4] = s[5];
  d[5] = t.share * (square * std::cos(at) + a * std::sin(at)) - t.w * (t.w * s[4] + 2 * t.zeta * s[5]);
  d[6] = s[7];
  d[7] = t.share * (square * std::sin(at) - a * std::cos(at)) - t.w * (t.w * s[6] + 2 * t.zeta * s[7]);
  return d;
}

inline State linear_whirl(const TwoCriticals& t, double w, double beta) {
  const std::complex<double> i(0, 1), turn = std::polar(w * w, beta);
  const std::complex<double> z = turn * std::polar(t.first.e, t.first.e_phase) /
                                 (t.first.k - w * w + i * t.first.c * w),
                             q = turn * std::polar(t.share, t.phase) / (t.w * t.w - w * w + 2.0 * i * t.zeta * t.w * w);
  return {z.real(), (i * w * z).real(), z.imag(), (i * w * z).imag(),
          q.real(), (i * w * q).real(), q.imag(), (i * w * q).imag()};
}

}  // namespace two_criticals_detail

/// Record x, y, beta of a sweep with white noise `snr` dB below each axis; the steady linear whirl at its first speed
/// before.
inline Recording two_criticals_record(const TwoCriticals& t, const Run& run, double snr, unsigned long long seed) {
  using machines_detail::State;
  const double h = 2.5e-4;
  const auto f = [&](double now, const State& s) {
    return two_criticals_detail::slope(t, run.beta(now), run.omega(now), run.alpha(), s);
  };
  State s = two_criticals_detail::linear_whirl(t, run.omega(0), run.beta0);
  const auto substeps = static_cast<int>(std::lround(run.dt / h));
  Eigen::MatrixX2d z(run.samples(), 2);
  for (Eigen::Index k = 0; k < z.rows(); ++k) {
    z.row(k) << s[0] + s[4], s[2] + s[6];
    for (int j = 0; j < substeps; ++j) s = machines_detail::step(f, run.dt * static_cast<double>(k) + h * j, s, h);
  }
  add_noise(z, snr, seed * 104729 + 3);
  return machine_record(z, run);
}

/// Radius of its steady whirl at a speed, reached by a slow rise from rest at that speed, m.
inline double two_criticals_radius(const TwoCriticals& t, double hz) {
  using machines_detail::State;
  const double w = 2 * std::numbers::pi * hz, h = 2.5e-4;
  const auto f = [&](double now, const State& s) { return two_criticals_detail::slope(t, w * now, w, 0, s); };
  State s = two_criticals_detail::linear_whirl(t, w, 0);
  const double seconds = 20 / std::min(t.first.c, 2 * t.zeta * t.w);
  double largest = 0;
  for (double now = 0; now < seconds; now += h) {
    s = machines_detail::step(f, now, s, h);
    if (now > 0.9 * seconds) largest = std::max(largest, std::hypot(s[0] + s[4], s[2] + s[6]));
  }
  return largest;
}

}  // namespace whirl::testing
