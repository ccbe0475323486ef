#pragma once
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/signal/angle.hpp"

/// Synthetic rotor records for the tests, made apart from the code under test: Runge-Kutta with ten steps per sample,
/// angle in closed form.
namespace whirl::testing {

using identification::RotorRecord;

constexpr double kTurn = 2 * std::numbers::pi;
using Complex = std::complex<double>;

/// Linear sweep, Hz.
struct Sweep {
  double from = 30, to = 0, seconds = 12, beta0 = 0, dt = 1e-3;
  double omega0() const { return kTurn * from; }
  double alpha() const { return kTurn * (to - from) / seconds; }
  Eigen::Index samples() const { return static_cast<Eigen::Index>(std::lround(seconds / dt)); }
  AngleSignal angle() const { return signal::angle_from_profile(beta0, omega0(), alpha(), dt, samples()); }
};

/// Rotor A of the identification notes: 12 Hz, zeta 2 %, cubic 25 % of the linear force at 3 mm, e 0.08 mm at 0.7 rad.
inline RotorModel rotor_a() {
  RotorModel m;
  m.k1 = std::pow(kTurn * 12, 2);
  m.k2 = 0.25 * m.k1 / 9e-6;
  m.c = 2 * 0.02 * kTurn * 12;
  m.eps = std::polar(8e-5, 0.7);
  return m;
}
/// Eccentricity that `grams` add to rotor A.
inline Complex added_mass(double grams) { return std::polar(1.7e-4 * grams / 5, 1.2); }

/// Angle, speed and acceleration at a time: any closed form.
using AngleLaw = std::function<std::array<double, 3>(double)>;

/// Noise-free motion as the sensors see it, from steady whirl (speed not 0 at the start) or rest.
inline Eigen::VectorXcd motion(const RotorModel& m, const AngleLaw& law, double dt, Eigen::Index samples) {
  const double w0 = law(0)[1];
  const auto forcing = [&](double t) {
    const auto [b, w, a] = law(t);
    return std::polar(1.0, b) * Complex(w * w, -a);
  };
  using State = Eigen::VectorXcd;  // z, z', then q, q' of each mode
  const auto modes = static_cast<Eigen::Index>(m.modes.size());
  State s = State::Zero(2 + 2 * modes);
  if (w0 != 0) {
    for (int k = 0; k < 200; ++k) {
      s[0] = m.eps * forcing(0) / (Complex(m.k1 + m.k2 * std::norm(s[0]) - w0 * w0, m.c * w0));
    }
    s[1] = Complex(0, w0) * s[0];
    for (Eigen::Index k = 0; k < modes; ++k) {
      const ForcedMode& q = m.modes[static_cast<std::size_t>(k)];
      s[2 + 2 * k] = forcing(0) / Complex(q.omega * q.omega - w0 * w0, 2 * q.zeta * q.omega * w0);
      s[3 + 2 * k] = Complex(0, w0) * s[2 + 2 * k];
    }
  }
  const auto f = [&](double t, const State& v) {
    State d(v.size());
    const Complex force = forcing(t);
    d[0] = v[1];
    d[1] = -m.k1 * v[0] - m.k1_conj * std::conj(v[0]) - m.k2 * std::norm(v[0]) * v[0] - m.c * v[1] -
           m.c_conj * std::conj(v[1]) + m.eps * force;
    for (Eigen::Index k = 0; k < modes; ++k) {
      const ForcedMode& q = m.modes[static_cast<std::size_t>(k)];
      d[2 + 2 * k] = v[3 + 2 * k];
      d[3 + 2 * k] = force - 2 * q.zeta * q.omega * v[3 + 2 * k] - q.omega * q.omega * v[2 + 2 * k];
    }
    return d;
  };
  Eigen::VectorXcd z(samples);
  const int substeps = modes > 0 ? 10 : 4;
  const double h = dt / substeps;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    z[i] = s[0] + m.offset;
    for (Eigen::Index k = 0; k < modes; ++k) z[i] += m.modes[static_cast<std::size_t>(k)].participation * s[2 + 2 * k];
    for (int j = 0; j < substeps; ++j) s = rk4_step(f, dt * static_cast<double>(i) + j * h, s, h);
  }
  return z;
}
inline Eigen::VectorXcd motion(const RotorModel& m, const Sweep& sweep) {
  const double b0 = sweep.beta0, w0 = sweep.omega0(), a = sweep.alpha();
  return motion(
      m,
      [=](double t) {
        return std::array{b0 + t * (w0 + 0.5 * a * t), w0 + a * t, a};
      },
      sweep.dt, sweep.samples());
}

/// White noise of `snr` dB below the standard deviation of each axis.
inline Eigen::VectorXcd with_noise(const Eigen::VectorXcd& z, double snr, unsigned long long seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto sd = [](const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); };
  const double factor = std::pow(10.0, -snr / 20);
  const double sx = sd(z.real()) * factor, sy = sd(z.imag()) * factor;
  Eigen::VectorXcd out = z;
  for (Complex& v : out) {
    const double nx = sx * normal(random), ny = sy * normal(random);
    v += Complex(nx, ny);
  }
  return out;
}

inline Recording recording(const Eigen::VectorXcd& z, const Sweep& sweep) {
  Recording r;
  r.dt = sweep.dt;
  r.source = "synthetic";
  r.add("x", Quantity::displacement, z.real());
  r.add("y", Quantity::displacement, z.imag());
  const AngleSignal a = sweep.angle();
  Eigen::VectorXd beta(a.samples());
  for (Eigen::Index i = 0; i < beta.size(); ++i) beta[i] = a.beta[2 * i];
  r.add("beta", Quantity::angle, beta);
  return r;
}

/// Record with the exact angle.
inline RotorRecord record(const Eigen::VectorXcd& z, const Sweep& sweep) {
  identification::RotorRecordOptions o;
  o.known_angle = sweep.angle();
  return identification::rotor_record(recording(z, sweep), o);
}

/// Errors of an identified rotor: shares in %, phase in degrees.
struct ModelError {
  double k1, k2, c, e, phase;
};
inline ModelError model_error(const RotorModel& found, const RotorModel& truth) {
  return {100 * (found.k1 / truth.k1 - 1), 100 * (found.k2 / truth.k2 - 1), 100 * (found.c / truth.c - 1),
          100 * (std::abs(found.eps) / std::abs(truth.eps) - 1), 360 / kTurn * std::arg(found.eps / truth.eps)};
}

}  // namespace whirl::testing
