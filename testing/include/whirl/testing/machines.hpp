#pragma once
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Rotors that leave the plain model class, and their records, made apart from the code under test: real coordinates,
/// forces written one by one, Dormand-Prince steps instead of Runge-Kutta 4. Nothing here knows RotorModel.
namespace whirl::testing {

/// What is unusual about a rotor. Sizes are those of docs/validation.md.
enum class Oddity {
  none,
  bow,                 ///< shaft bent by 50 um; the springs act on the motion without the bow
  damping_in_time,     ///< damping grows by half over the record
  damping_with_speed,  ///< damping at the top speed is half as large again as at rest
  warming,             ///< stiffness falls by 1 % over the record
  quintic,             ///< fifth-order spring, 10 % of the linear force at 3 mm
  gyroscopic,          ///< force along i omega z'
  rotating_damping,    ///< 30 % of the damping turns with the shaft
  sensor_gain,         ///< y reads 3 % high
  sensor_angle,        ///< axes at 88 degrees
  cubic_per_axis,      ///< x^3 and y^3 instead of |z|^2 z
  quadratic_damping,   ///< |v| v
  coulomb,             ///< dry friction
  anisotropic,         ///< stiffness differs by 2 %
  cross_coupled,       ///< force along i z, 20 % of the damping force at the critical speed
  stiffness_with_speed,
  tilt,  ///< disc that tilts: a second mode with gyroscopic splitting
};
inline constexpr std::array kOddities = {
    Oddity::none,        Oddity::bow,          Oddity::damping_in_time, Oddity::damping_with_speed,
    Oddity::warming,     Oddity::quintic,      Oddity::gyroscopic,      Oddity::rotating_damping,
    Oddity::sensor_gain, Oddity::sensor_angle, Oddity::cubic_per_axis,  Oddity::quadratic_damping,
    Oddity::coulomb,     Oddity::anisotropic,  Oddity::cross_coupled,   Oddity::stiffness_with_speed,
    Oddity::tilt};
inline const char* to_string(Oddity o) {
  constexpr std::array names = {"none",        "bow",          "damping in time", "damping with speed",
                                "warming",     "quintic",      "gyroscopic",      "rotating damping",
                                "sensor gain", "sensor angle", "cubic per axis",  "quadratic damping",
                                "Coulomb",     "anisotropic",  "cross-coupled",   "stiffness with speed",
                                "tilt"};
  return names[static_cast<std::size_t>(o)];
}

/// Disc on a shaft, everything per unit mass of the disc; SI.
struct Machine {
  double k = 0, cubic = 0, c = 0;             ///< 1/s^2, 1/(m^2 s^2) radial, 1/s
  double e = 0, e_phase = 0;                  ///< m, rad
  double cubic_axis = 0, quintic = 0;         ///< per axis 1/(m^2 s^2); radial 1/(m^4 s^2)
  double lean_x = 0, lean_y = 0;              ///< potential (lean . z) |z|^2 / 2, 1/(m s^2): stiffer towards `lean`
  double quadratic = 0, dry = 0;              ///< damping |v| v 1/m; friction m/s^2
  double gyroscopic = 0;                      ///< acceleration g omega along i z'
  double c_rotating = 0;                      ///< 1/s
  double cross = 0;                           ///< 1/s^2
  double split = 0, split_angle = 0;          ///< stiffness k (1 +- split) along the axes turned by split_angle
  double k_in_time = 0, c_in_time = 0;        ///< relative change over `horizon`
  double k_with_speed = 0, c_with_speed = 0;  ///< relative change at `top_speed`
  double horizon = 1, top_speed = 1;          ///< s, rad/s
  double bow = 0, bow_phase = 0;              ///< m, rad
  double load_x = 0, load_y = 0;              ///< m/s^2
  // Sensors
  double offset_x = 0, offset_y = 0;           ///< m
  double gain_x = 1, gain_y = 1;               ///< reading by motion
  double sensor_angle = std::numbers::pi / 2;  ///< direction of the y sensor from that of x, rad
  // Tilt of the disc: angle (phi_x, phi_y) times a length; stiffness of it, coupling with the motion, polar inertia
  // share
  bool tilts = false;
  double k_tilt = 0, k_couple = 0, polar = 0, tilt_unbalance = 0;
};

/// Linear sweep with its sampling.
struct Run {
  double from_hz = 30, to_hz = 0, seconds = 12, beta0 = 0, dt = 1e-3;
  Eigen::Index samples() const { return static_cast<Eigen::Index>(std::lround(seconds / dt)); }
  double omega(double t) const { return 2 * std::numbers::pi * (from_hz + (to_hz - from_hz) * t / seconds); }
  double alpha() const { return 2 * std::numbers::pi * (to_hz - from_hz) / seconds; }
  double beta(double t) const { return beta0 + 2 * std::numbers::pi * from_hz * t + 0.5 * alpha() * t * t; }
};

namespace machines_detail {

using State = std::array<double, 8>;  // x, x', y, y', tilt p, p', q, q'

inline State slope(const Machine& m, double t, double beta, double w, double a, const State& s) {
  const double x = s[0], vx = s[1], y = s[2], vy = s[3];
  // Sines and roots are most of the cost of a record: those of a force that is not there are left out.
  double dx = x, dy = y;  // deflection of the shaft
  if (m.bow != 0) dx -= m.bow * std::cos(m.bow_phase + beta), dy -= m.bow * std::sin(m.bow_phase + beta);
  const double late = t / m.horizon, fast = std::abs(w) / m.top_speed;
  const double k = m.k * (1 + m.k_in_time * late) * (1 + m.k_with_speed * fast);
  const double c = m.c * (1 + m.c_in_time * late) * (1 + m.c_with_speed * fast);
  const double r2 = dx * dx + dy * dy;
  const double radial = k + m.cubic * r2 + m.quintic * r2 * r2;
  double fx = -radial * dx - m.cubic_axis * dx * dx * dx, fy = -radial * dy - m.cubic_axis * dy * dy * dy;
  const double leaning = m.lean_x * dx + m.lean_y * dy;
  fx -= leaning * dx + 0.5 * r2 * m.lean_x, fy -= leaning * dy + 0.5 * r2 * m.lean_y;
  if (m.split != 0) {
    const double ca = std::cos(m.split_angle), sa = std::sin(m.split_angle);
    const double along = ca * dx + sa * dy, across = -sa * dx + ca * dy;
    fx -= m.k * m.split * (ca * along + sa * across);
    fy -= m.k * m.split * (sa * along - ca * across);
  }
  double drag = c;
  if (m.quadratic != 0 || m.dry != 0) {
    const double speed = std::hypot(vx, vy);
    drag += m.quadratic * speed + m.dry / std::hypot(speed, 1e-4);
  }
  fx -= drag * vx + m.c_rotating * (vx + w * y) + m.gyroscopic * w * vy + m.cross * y;
  fy -= drag * vy + m.c_rotating * (vy - w * x) - m.gyroscopic * w * vx - m.cross * x;
  const double heavy = m.e_phase + beta, w2 = w * w;
  const double ux = w2 * std::cos(heavy) + a * std::sin(heavy), uy = w2 * std::sin(heavy) - a * std::cos(heavy);
  State d{};
  d[0] = vx;
  d[1] = fx + m.e * ux + m.load_x;
  d[2] = vy;
  d[3] = fy + m.e * uy + m.load_y;
  if (m.tilts) {
    d[1] -= m.k_couple * s[4];
    d[3] -= m.k_couple * s[6];
    d[4] = s[5];
    d[5] = -m.k_tilt * s[4] - m.k_couple * x - m.c * s[5] - m.polar * w * s[7] + m.tilt_unbalance * ux;
    d[6] = s[7];
    d[7] = -m.k_tilt * s[6] - m.k_couple * y - m.c * s[7] + m.polar * w * s[5] + m.tilt_unbalance * uy;
  }
  return d;
}

/// One step of Dormand and Prince 1980, fifth order, fixed step.
template <class Slope>
State step(const Slope& f, double t, const State& s, double h) {
  const auto at = [&](std::initializer_list<std::pair<double, const State*>> sum) {
    State v = s;
    for (const auto& [b, k] : sum) {
      for (std::size_t i = 0; i < v.size(); ++i) v[i] += h * b * (*k)[i];
    }
    return v;
  };
  const State k1 = f(t, s);
  const State k2 = f(t + h / 5, at({{1.0 / 5, &k1}}));
  const State k3 = f(t + 3 * h / 10, at({{3.0 / 40, &k1}, {9.0 / 40, &k2}}));
  const State k4 = f(t + 4 * h / 5, at({{44.0 / 45, &k1}, {-56.0 / 15, &k2}, {32.0 / 9, &k3}}));
  const State k5 =
      f(t + 8 * h / 9, at({{19372.0 / 6561, &k1}, {-25360.0 / 2187, &k2}, {64448.0 / 6561, &k3}, {-212.0 / 729, &k4}}));
  const State k6 = f(
      t + h,
      at({{9017.0 / 3168, &k1}, {-355.0 / 33, &k2}, {46732.0 / 5247, &k3}, {49.0 / 176, &k4}, {-5103.0 / 18656, &k5}}));
  return at({{35.0 / 384, &k1}, {500.0 / 1113, &k3}, {125.0 / 192, &k4}, {-2187.0 / 6784, &k5}, {11.0 / 84, &k6}});
}

}  // namespace machines_detail

/// What the two sensors read without noise, columns x and y. `times`: when each sample is taken, ascending, s; empty:
/// i dt. The rotor has turned at the first speed for two seconds before.
inline Eigen::MatrixX2d readings(const Machine& m, const Run& run, const Eigen::VectorXd& times = {}) {
  using machines_detail::State;
  const auto f = [&](double t, const State& s) {
    const bool before = t < 0;  // constant speed
    return machines_detail::slope(m, std::max(t, 0.0), before ? run.beta0 + run.omega(0) * t : run.beta(t),
                                  run.omega(std::max(t, 0.0)), before ? 0.0 : run.alpha(), s);
  };
  const double lead = 2, h = 2.5e-4;
  State s{};
  // Linear steady whirl as a start; what is left of the transient decays before or in the record.
  const double w = run.omega(0);
  const std::complex<double> pull = m.k * std::polar(m.bow, m.bow_phase) + w * w * std::polar(m.e, m.e_phase);
  const std::complex<double> z =
      pull / std::complex<double>(m.k - w * w, m.c * w) * std::polar(1.0, run.beta0 - w * lead);
  s[0] = z.real();
  s[1] = -w * z.imag();
  s[2] = z.imag();
  s[3] = w * z.real();
  double t = -lead;
  const auto advance = [&](double to) {
    const int steps = std::max(1, static_cast<int>(std::ceil((to - t) / h - 1e-9)));
    const double d = (to - t) / steps;
    if (d <= 0) return;
    for (int i = 0; i < steps; ++i) s = machines_detail::step(f, t + i * d, s, d);
    t = to;
  };
  advance(0);
  const Eigen::Index n = times.size() ? times.size() : run.samples();
  Eigen::MatrixX2d out(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    advance(times.size() ? times[i] : run.dt * static_cast<double>(i));
    out(i, 0) = m.gain_x * s[0] + m.offset_x;
    out(i, 1) = m.gain_y * (std::cos(m.sensor_angle) * s[0] + std::sin(m.sensor_angle) * s[2]) + m.offset_y;
  }
  return out;
}

/// Adds white noise `snr` dB below the standard deviation of each axis.
inline void add_noise(Eigen::MatrixX2d& z, double snr, unsigned long long seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double factor = std::pow(10.0, -snr / 20);
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    const double mean = z.col(axis).mean();
    const double sd = std::sqrt((z.col(axis).array() - mean).square().mean()) * factor;
    for (Eigen::Index i = 0; i < z.rows(); ++i) z(i, axis) += sd * normal(random);
  }
}

/// A drawn rotor with its run.
struct DrawnMachine {
  Machine machine;
  Run run;
};

/// fn 11 to 13 Hz, damping 1 to 3 %, hardening 20 to 30 % at 3 mm, e 0.06 to 0.16 mm, offset within 0.1 mm, run-down
/// of 12 s from 25 to 40 Hz at 1 kHz: the class of docs/validation.md, with one oddity.
inline DrawnMachine draw_machine(Oddity oddity, unsigned long long seed) {
  std::mt19937_64 random(seed * 7919 + 17);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  DrawnMachine d;
  Machine& m = d.machine;
  const double w = 2 * std::numbers::pi * uniform(11, 13);
  m.k = w * w;
  m.cubic = uniform(0.20, 0.30) * m.k / 9e-6;
  m.c = 2 * uniform(0.01, 0.03) * w;
  m.e = uniform(6e-5, 16e-5);
  m.e_phase = uniform(-3, 3);
  m.offset_x = uniform(-1e-4, 1e-4);
  m.offset_y = uniform(-1e-4, 1e-4);
  d.run.from_hz = uniform(25, 40);
  d.run.beta0 = uniform(-3, 3);
  m.horizon = d.run.seconds;
  m.top_speed = d.run.omega(0);
  const double angle = uniform(-3, 3);
  const double sign = uniform(-1, 1) < 0 ? -1 : 1;
  switch (oddity) {
    case Oddity::none:
      break;
    case Oddity::bow:
      m.bow = 5e-5, m.bow_phase = angle;
      break;
    case Oddity::damping_in_time:
      m.c_in_time = 0.5;
      break;
    case Oddity::damping_with_speed:
      m.c_with_speed = 0.5;
      break;
    case Oddity::warming:
      m.k_in_time = -0.01;
      break;
    case Oddity::quintic:
      m.quintic = 0.1 * m.k / 8.1e-11;
      break;
    case Oddity::gyroscopic:
      m.gyroscopic = 0.02 * sign;
      break;
    case Oddity::rotating_damping:
      m.c_rotating = 0.3 * m.c, m.c *= 0.7;
      break;
    case Oddity::sensor_gain:
      m.gain_y = 1.03;
      break;
    case Oddity::sensor_angle:
      m.sensor_angle = 88 * std::numbers::pi / 180;
      break;
    case Oddity::cubic_per_axis:
      m.cubic_axis = m.cubic, m.cubic = 0;
      break;
    case Oddity::quadratic_damping:
      m.quadratic = m.c / (w * 1e-3);
      break;
    case Oddity::coulomb:
      m.dry = 0.15 * m.c * w * 2e-3;
      break;
    case Oddity::anisotropic:
      m.split = 0.01, m.split_angle = angle;
      break;
    case Oddity::cross_coupled:
      m.cross = 0.2 * m.c * w;
      break;
    case Oddity::stiffness_with_speed:
      m.k_with_speed = 0.02 * sign;
      break;
    case Oddity::tilt: {
      m.tilts = true;
      m.k_tilt = std::pow(1.9 * w, 2);
      m.k_couple = 0.4 * w * w;
      m.polar = 0.3;
      m.tilt_unbalance = 0.5 * m.e;
      m.k += m.k_couple * m.k_couple / m.k_tilt;  // keeps the lower mode near w
      break;
    }
  }
  return d;
}

/// Record with channels x, y (m) and beta (rad, exact).
inline Recording machine_record(const Eigen::MatrixX2d& z, const Run& run) {
  Recording r;
  r.dt = run.dt;
  r.source = "synthetic";
  Eigen::VectorXd beta(z.rows());
  for (Eigen::Index i = 0; i < beta.size(); ++i) beta[i] = run.beta(run.dt * static_cast<double>(i));
  r.add("x", Quantity::displacement, z.col(0));
  r.add("y", Quantity::displacement, z.col(1));
  r.add("beta", Quantity::angle, beta);
  return r;
}

/// Drawn rotor, simulated, with noise.
inline Recording machine_record(const DrawnMachine& d, double snr, unsigned long long seed) {
  Eigen::MatrixX2d z = readings(d.machine, d.run);
  add_noise(z, snr, seed * 104729 + 5);
  return machine_record(z, d.run);
}

/// The same through a recorder that stores the mean of `count` samples with the time and angle of the first.
inline Recording averaged_record(const DrawnMachine& d, double snr, unsigned long long seed, Eigen::Index count) {
  DrawnMachine fine = d;
  fine.run.dt /= static_cast<double>(count);
  Eigen::MatrixX2d z = readings(fine.machine, fine.run);
  Eigen::MatrixX2d means(z.rows() / count, 2);
  for (Eigen::Index i = 0; i < means.rows(); ++i) means.row(i) = z.middleRows(count * i, count).colwise().mean();
  add_noise(means, snr, seed * 104729 + 5);
  return machine_record(means, d.run);
}

}  // namespace whirl::testing
