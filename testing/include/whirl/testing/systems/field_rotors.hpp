#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "whirl/testing/machines.hpp"

/// Rotors as they stand in plants: fluid, seals, loose feet, neighbours, worn journals, and the measuring chains beside
/// them. Drawn with a seed and made apart from the code under test: real coordinates, forces written one by one,
/// Dormand-Prince steps. Nothing here knows RotorModel or its terms.
namespace whirl::testing {

enum class FieldKind {
  fluid_whirl,      ///< cross-coupled force that grows with the square of the speed, 50 to 80 % of what drives a whirl
  morton,           ///< bow that follows the vibration by 2 to 4 %, late by 2 to 4 s
  seal_rub,         ///< beyond 60 to 80 % of the peak: 0.1 to 0.3 k more, and dry friction against the rotation
  loose_foot,       ///< upwards the support is softer by 4 to 10 %
  lobed_journal,    ///< the probes see a track with 1, 2 and 3 lobes of 15, 8 and 4 um
  jitter,           ///< the angle is read from one pulse a turn with 30 to 80 us of jitter
  hum,              ///< an inverter's carrier, folded to 8 to 20 Hz by sampling, 2 to 4 % of the peak
  neighbour,        ///< another machine shakes the floor along x at 14 to 24 Hz, whatever the speed
  slipped_disc,     ///< the unbalance turns by 15 to 40 degrees on the shaft at one instant
  warm_up,          ///< k falls by 1 to 2 %, three quarters of it within 5 s
  saturating_x,     ///< the x amplifier takes 2 to 5 % off the peak
  dwell,            ///< the run-down rests for 3 s at 1.1 to 1.3 times the critical speed
  notch,            ///< both amplifiers have a notch at 50 Hz, half as wide as its frequency
  warming_probes,   ///< both gains fall by 2 to 4 % over the run
  worn_pump,        ///< k differs by 1 to 2 %, the shaft has a bow, y reads 2 to 4 % high
  stuck_angle,      ///< the angle stands still for 0.1 to 0.3 s in the record, not in the machine
  cold_grease,      ///< damping falls to 60 to 80 %, most of it within 4 s
  tight_and_loose,  ///< dry friction in the seat, and unequal stiffness
};
struct FieldName {
  FieldKind kind;
  const char* name;
  /// Labels of which any names the cause; '+' joins those that are needed together. Empty: no list of terms has it.
  std::vector<std::string_view> causes;
};
inline const std::vector<FieldName>& field_kinds() {
  static const std::vector<FieldName> all{
      {FieldKind::fluid_whirl,
       "fluid whirl",
       {"cross-coupled stiffness", "damping changing with speed", "rotating damping"}},
      {FieldKind::morton, "Morton bow", {}},
      {FieldKind::seal_rub, "seal rub", {}},
      {FieldKind::loose_foot, "loose foot", {}},
      {FieldKind::lobed_journal, "lobed journal", {"runout", "bow of the shaft"}},
      {FieldKind::jitter, "jittering pulses", {}},
      {FieldKind::hum, "folded hum", {}},
      {FieldKind::neighbour, "neighbour machine", {}},
      {FieldKind::slipped_disc, "slipped disc", {"unbalance changing at one instant"}},
      {FieldKind::warm_up, "warm-up", {"stiffness drifting in time"}},
      {FieldKind::saturating_x, "saturating x", {"probe curve"}},
      {FieldKind::dwell, "dwell in the run-down", {}},
      {FieldKind::notch, "notch at 50 Hz", {}},
      {FieldKind::warming_probes, "warming probes", {"gain of the probes drifting in time"}},
      {FieldKind::worn_pump, "worn pump", {"anisotropic stiffness+sensor gain+runout|bow of the shaft"}},
      {FieldKind::stuck_angle, "stuck angle", {}},
      {FieldKind::cold_grease, "cold grease", {"damping drifting in time"}},
      {FieldKind::tight_and_loose, "friction, unequal k", {"Coulomb friction+anisotropic stiffness"}}};
  return all;
}

/// A record, another run of the same machine through the same chain, and what is true of its rotor; NaN: not defined.
struct FieldRecord {
  Recording record, other, other_clean;
  double k1, k2, c, e;
  double k1_last, c_last;  ///< at the end of the record, where they change
};

namespace field_detail {

using machines_detail::State;  // x, x', y, y', four of the part

/// Sizes of the parts, drawn; those of other kinds are 0.
struct Parts {
  double whirl = 0;                                     // 1/s^2 per (rad/s)^2
  std::complex<double> heat = 0;                        // bow by vibration
  double late = 1;                                      // s
  double gap = 0, seal = 0, rubbing = 0;                // m, 1/s^2, share
  double lift = 0;                                      // share of k
  std::array<double, 3> lobes{};                        // m
  double jitter = 0;                                    // s
  double hum = 0, hum_hz = 0, shake = 0, shake_hz = 0;  // share of the peak, Hz, m/s^2, Hz
  double slip = 0, instant = 0;                         // rad, s
  double k_falls = 0, c_falls = 0, within = 1;          // shares, s
  double bent = 0;                                      // share of the peak
  double rest = 0, rest_hz = 0;                         // s, Hz
  bool notch = false;
  double gain_falls = 0;  // share
  double stuck = 0;       // s
  double phase = 0;       // rad, of what has one
};

/// Speed of a linear sweep that rests on its way.
struct Course {
  Run run;
  double rest = 0, rest_at = 0;  // s
  double swept(double t) const { return t <= rest_at ? t : std::max(rest_at, t - rest); }
  bool resting(double t) const { return t < 0 || (rest > 0 && t > rest_at && t < rest_at + rest); }
  double omega(double t) const { return run.omega(std::max(0.0, swept(t))); }
  double alpha(double t) const { return resting(t) ? 0.0 : run.alpha(); }
  double beta(double t) const {
    if (t < 0) return run.beta0 + run.omega(0) * t;
    return run.beta(swept(t)) + (t - swept(t)) * run.omega(rest_at);
  }
};

/// To standstill, with the rest of the parts.
inline Course course_of(Run run, const Parts& p) {
  const double sweep = run.seconds - p.rest;
  run.to_hz = run.from_hz * (1 - run.seconds / sweep);
  return {run, p.rest, p.rest > 0 ? sweep * (1 - p.rest_hz / run.from_hz) : 0};
}

inline Parts draw_parts(FieldKind kind, Machine& m, const Run& run, double peak, unsigned long long seed) {
  std::mt19937_64 random(seed * 0xD1342543DE82EF95ULL + 71);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Parts p;
  p.phase = uniform(-3, 3);
  const double w = std::sqrt(m.k), sign = uniform(-1, 1) < 0 ? -1 : 1;
  switch (kind) {
    case FieldKind::fluid_whirl:
      p.whirl = uniform(0.5, 0.8) * m.c * w / (m.top_speed * m.top_speed);
      break;
    case FieldKind::morton:
      p.heat = std::polar(uniform(0.02, 0.04), p.phase), p.late = uniform(2, 4);
      break;
    case FieldKind::seal_rub:
      p.gap = uniform(0.6, 0.8) * peak, p.seal = uniform(0.1, 0.3) * m.k, p.rubbing = uniform(0.1, 0.3);
      break;
    case FieldKind::loose_foot:
      p.lift = uniform(0.04, 0.1);
      break;
    case FieldKind::lobed_journal:
      p.lobes = {15e-6, 8e-6, 4e-6};
      break;
    case FieldKind::jitter:
      p.jitter = uniform(3e-5, 8e-5);
      break;
    case FieldKind::hum:
      p.hum = uniform(0.02, 0.04), p.hum_hz = uniform(8, 20);
      break;
    case FieldKind::neighbour:
      p.shake = uniform(0.05, 0.15) * m.e * m.k, p.shake_hz = uniform(14, 24);
      break;
    case FieldKind::slipped_disc:
      p.slip = sign * uniform(15, 40) * std::numbers::pi / 180, p.instant = run.seconds * uniform(0.3, 0.7);
      break;
    case FieldKind::warm_up:
      p.k_falls = uniform(0.01, 0.02), p.within = uniform(2, 4);
      break;
    case FieldKind::saturating_x:
      p.bent = uniform(0.02, 0.05);
      break;
    case FieldKind::dwell:
      p.rest = 3, p.rest_hz = uniform(1.1, 1.3) * w / (2 * std::numbers::pi);
      break;
    case FieldKind::notch:
      p.notch = true;
      break;
    case FieldKind::warming_probes:
      p.gain_falls = uniform(0.02, 0.04);
      break;
    case FieldKind::worn_pump:
      m.split = uniform(0.005, 0.01), m.split_angle = p.phase, m.bow = uniform(2e-5, 5e-5),
      m.bow_phase = uniform(-3, 3);
      m.gain_y = uniform(1.02, 1.04);
      break;
    case FieldKind::stuck_angle:
      p.stuck = uniform(0.1, 0.3);
      break;
    case FieldKind::cold_grease:
      p.c_falls = uniform(0.2, 0.4), p.within = uniform(2, 4);
      break;
    case FieldKind::tight_and_loose:
      m.dry = uniform(0.1, 0.2) * m.c * w * 2e-3, m.split = uniform(0.005, 0.01), m.split_angle = p.phase;
      break;
  }
  return p;
}

/// Forces of the parts beside those of the machine.
inline State slope(const Machine& healthy, const Parts& p, const Course& course, double t, const State& s) {
  const double beta = course.beta(t), w = course.omega(t), a = course.alpha(t), now = std::max(t, 0.0);
  Machine m = healthy;
  m.k *= 1 - p.k_falls * (1 - std::exp(-now / p.within));
  m.c *= 1 - p.c_falls * (1 - std::exp(-now / p.within));
  if (t > p.instant) m.e_phase += p.slip;
  State d = machines_detail::slope(m, now, beta, w, a, s);
  const double r = std::hypot(s[0], s[2]);
  d[1] -= p.whirl * w * w * s[2];
  d[3] += p.whirl * w * w * s[0];
  if (std::abs(p.heat) > 0) {  // the bow turns with the shaft, and is heated by the motion as the shaft sees it
    const std::complex<double> turn = std::polar(1.0, beta), bow(s[4], s[6]);
    const std::complex<double> pull = m.k * bow * turn;
    d[1] += pull.real(), d[3] += pull.imag();
    const std::complex<double> follows = (p.heat * std::complex<double>(s[0], s[2]) / turn - bow) / p.late;
    d[4] = follows.real(), d[6] = follows.imag();
  }
  if (p.gap > 0 && r > p.gap) {
    const double press = p.seal * (r - p.gap);
    d[1] += press * (-s[0] + p.rubbing * s[2]) / r;
    d[3] += press * (-s[2] - p.rubbing * s[0]) / r;
  }
  if (s[2] > 0) d[3] += p.lift * m.k * s[2];
  d[1] += p.shake * std::cos(2 * std::numbers::pi * p.shake_hz * t + p.phase);
  return d;
}

/// y'' + b y' + w^2 y = v'' + w^2 v at every sample (bilinear, warped to hold at w).
inline void notch(Eigen::Ref<Eigen::VectorXd> v, double hz, double wide, double dt) {
  const double turn = 2 * std::numbers::pi * hz * dt, g = std::tan(0.5 * turn), b = g * wide;
  const double a0 = 1 + b + g * g, n1 = 2 * (g * g - 1) / a0, n0 = (1 + g * g) / a0, d2 = (1 - b + g * g) / a0;
  double v1 = v[0], v2 = v[0], y1 = v[0], y2 = v[0];
  for (double& x : v) {
    const double y = n0 * (x + v2) + n1 * (v1 - y1) - d2 * y2;
    v2 = v1, v1 = x, y2 = y1, y1 = y;
    x = y;
  }
}

/// What the probes give of the motion z.
inline void read(const Machine& m, const Parts& p, const Course& course, double peak, Eigen::MatrixX2d& z) {
  for (Eigen::Index i = 0; i < z.rows(); ++i) {
    const double t = course.run.dt * static_cast<double>(i), beta = course.beta(t);
    for (std::size_t k = 0; k < p.lobes.size(); ++k) {
      const double n = static_cast<double>(k + 1);
      z(i, 0) += p.lobes[k] * std::cos(n * beta + p.phase * n);
      z(i, 1) += p.lobes[k] * std::cos(n * (beta - 0.5 * std::numbers::pi) + p.phase * n);
    }
    z(i, 0) -= p.bent * z(i, 0) * z(i, 0) * z(i, 0) / (peak * peak);
    z.row(i) *= 1 - p.gain_falls * t / course.run.seconds;
    z(i, 1) *= m.gain_y;
    const double hum = p.hum * peak * std::cos(2 * std::numbers::pi * p.hum_hz * t + p.phase);
    z(i, 0) += hum + m.offset_x;
    z(i, 1) += 0.7 * hum + m.offset_y;
  }
  if (p.notch)
    for (Eigen::Index axis : {0, 1}) notch(z.col(axis), 50, 0.5, course.run.dt);
}

/// The angle as it is recorded.
inline Eigen::VectorXd angle(const Parts& p, const Course& course, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double turn = 2 * std::numbers::pi, dt = course.run.dt;
  const Eigen::Index n = course.run.samples();
  Eigen::VectorXd beta(n);
  for (Eigen::Index i = 0; i < n; ++i) beta[i] = course.beta(dt * static_cast<double>(i));
  if (p.jitter > 0) {  // what the angle gains by the jitter of the pulses, straight from one to the next
    const double first = std::floor(beta[0] / turn);
    std::vector<double> late(static_cast<std::size_t>(std::floor(beta[n - 1] / turn) - first) + 2);
    for (double& l : late) l = p.jitter * normal(random);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double turns = beta[i] / turn - first, share = turns - std::floor(turns);
      const auto k = static_cast<std::size_t>(turns);
      beta[i] -= course.omega(dt * static_cast<double>(i)) * ((1 - share) * late[k] + share * late[k + 1]);
    }
  }
  if (p.stuck > 0) {
    const auto from = static_cast<Eigen::Index>((0.35 + 0.05 * p.phase) * static_cast<double>(n));
    beta.segment(from, static_cast<Eigen::Index>(p.stuck / dt)).setConstant(beta[from]);
  }
  return beta;
}

/// What the probes of the machine read over the course, without noise.
inline Eigen::MatrixX2d follow(const Machine& m, const Parts& p, const Course& course) {
  const auto f = [&](double t, const State& s) { return slope(m, p, course, t, s); };
  const double lead = 2, h = 2.5e-4, w = course.omega(0);
  const std::complex<double> z = w * w * std::polar(m.e, m.e_phase) / std::complex<double>(m.k - w * w, m.c * w) *
                                 std::polar(1.0, course.beta(-lead));
  State s{z.real(), -w * z.imag(), z.imag(), w * z.real()};
  const auto substeps = static_cast<Eigen::Index>(std::lround(course.run.dt / h));
  const auto before = static_cast<Eigen::Index>(std::lround(lead / course.run.dt));
  Eigen::MatrixX2d out(course.run.samples(), 2);
  for (Eigen::Index i = -before; i < out.rows(); ++i) {
    if (i >= 0) out.row(i) << s[0], s[2];
    const double t = course.run.dt * static_cast<double>(i);
    for (Eigen::Index j = 0; j < substeps; ++j) s = machines_detail::step(f, t + h * static_cast<double>(j), s, h);
  }
  return out;
}

}  // namespace field_detail

/// A drawn rotor of the kind at `snr` dB, and another run-down of it.
inline FieldRecord field_record(FieldKind kind, double snr, unsigned long long seed) {
  DrawnMachine drawn = draw_machine(Oddity::none, seed + 300000);
  Machine& m = drawn.machine;
  Run& run = drawn.run;
  const double peak = readings(m, run).rowwise().norm().maxCoeff();
  field_detail::Parts parts = field_detail::draw_parts(kind, m, run, peak, seed);
  std::mt19937_64 random(seed * 2862933555777941757ULL + 13);
  const auto record = [&](Recording& clean) {
    const field_detail::Course course = field_detail::course_of(run, parts);
    Eigen::MatrixX2d z = field_detail::follow(m, parts, course);
    field_detail::read(m, parts, course, peak, z);
    clean = machine_record(z, course.run);
    add_noise(z, snr, random());
    Recording r = machine_record(z, course.run);
    r.channels.back().samples = field_detail::angle(parts, course, random);
    return r;
  };
  const double late = 1 - std::exp(-run.seconds / parts.within);
  FieldRecord out{
      {}, {}, {}, m.k, m.cubic, m.c, m.e, m.k * (1 - parts.k_falls * late), m.c * (1 - parts.c_falls * late)};
  out.record = record(out.other_clean);
  // Another day: cold again, from another speed at another rate; what has slipped has slipped.
  parts.instant = -1e9;
  run.from_hz *= 0.9, run.seconds *= 0.85, run.beta0 += 1;
  out.other = record(out.other_clean);
  out.other.source = "another run";
  // There is no linear spring.
  if (kind == FieldKind::loose_foot) out.k1 = out.k2 = std::numeric_limits<double>::quiet_NaN();
  return out;
}

}  // namespace whirl::testing
