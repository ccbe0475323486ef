#pragma once
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/recording.hpp"

/// Runs of a rotor through its critical speed as velocity pickups or accelerometers read them: motion, high-pass and
/// readings by one set of differential equations.
namespace whirl::testing {

struct SensedRotor {
  double k1 = 0, k2 = 0, c = 0;     ///< 1/s^2, 1/(m^2 s^2), 1/s
  double e = 0, phase = 0;          ///< m, rad
  double from = 0, to = 0;          ///< speeds, Hz
  double bend = 0;                  ///< share by which the speed leaves a straight line in the middle of the run
  double seconds = 0, rate = 1000;  ///< s, Hz
  Quantity quantity = Quantity::acceleration;
  double corner = 0;      ///< of the high-pass of both sensors, Hz; 0: none
  double gain_y = 1;      ///< of the second sensor over the first
  double offset = 0;      ///< of both behind the high-pass, share of the rms
  double noise_db = 30;   ///< below the rms of each channel
  double difference = 0;  ///< of the springs of x and y, share of k1

  /// Speed, rad/s, at a share u of the run.
  double speed(double u) const {
    return 2 * std::numbers::pi * (from + (to - from) * u + 4 * bend * (to - from) * u * (1 - u));
  }
  double speed_rate(double u) const {
    return 2 * std::numbers::pi * (to - from) * (1 + 4 * bend * (1 - 2 * u)) / seconds;
  }
};

/// 8 to 25 Hz, damping ratio 0.8 to 4 %, hardening to 20 % of the spring at the peak, e 10 to 60 um; run-ups and
/// run-downs from 1.5 to 2.5 times the critical speed to 0.25 to 0.6 times it; sensors with a corner of 0.5 to 2 Hz,
/// noise of 20 to 40 dB.
inline SensedRotor drawn_rotor(Quantity quantity, std::mt19937_64& random) {
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  SensedRotor r;
  const double hz = between(8, 25), w = 2 * std::numbers::pi * hz, zeta = between(0.008, 0.04);
  r.k1 = w * w;
  r.c = 2 * zeta * w;
  r.e = between(10e-6, 60e-6);
  r.phase = between(-3, 3);
  const double peak = 0.7 * r.e / (2 * zeta);
  r.k2 = between(0, 0.2) * r.k1 / (peak * peak);
  r.from = between(1.5, 2.5) * hz;
  r.to = between(0.25, 0.6) * hz;
  if (between(0, 1) < 0.5) std::swap(r.from, r.to);
  r.bend = between(-0.15, 0.15);
  r.seconds = between(8, 20);
  r.rate = std::round(between(40, 80) * std::max(r.from, r.to));
  r.quantity = quantity;
  r.corner = between(0.5, 2);
  r.offset = between(-0.2, 0.2);
  r.noise_db = between(20, 40);
  return r;
}

/// Channels x and y (SI, of the rotor's quantity) and beta. `clean`: without noise, for comparison.
inline Recording sensed_record(const SensedRotor& r, unsigned long long seed, Recording* clean = nullptr) {
  using State = std::array<double, 8>;  // x, x', y, y', beta, slow part of x and y, time share
  constexpr int kFine = 8;
  const double dt = 1 / r.rate, h = dt / kFine, slow = 2 * std::numbers::pi * r.corner;
  const auto force = [&](const State& s, bool along_x) {
    const double w = r.speed(s[7]), a = r.speed_rate(s[7]), at = s[4] + r.phase;
    const double r2 = s[0] * s[0] + s[2] * s[2];
    const double k = r.k1 * (1 + (along_x ? 0.5 : -0.5) * r.difference) + r.k2 * r2;
    const double turn = along_x ? w * w * std::cos(at) + a * std::sin(at) : w * w * std::sin(at) - a * std::cos(at);
    return r.e * turn - k * s[along_x ? 0 : 2] - r.c * s[along_x ? 1 : 3];
  };
  const auto felt = [&](const State& s, bool along_x) {
    if (r.quantity == Quantity::displacement) return s[along_x ? 0 : 2];
    return r.quantity == Quantity::velocity ? s[along_x ? 1 : 3] : force(s, along_x);
  };
  const auto rate = [&](const State& s) -> State {
    return {s[1],
            force(s, true),
            s[3],
            force(s, false),
            r.speed(s[7]),
            slow * (felt(s, true) - s[5]),
            slow * (felt(s, false) - s[6]),
            1 / r.seconds};
  };
  const auto plus = [](const State& s, double by, const State& d) {
    State out = s;
    for (std::size_t k = 0; k < s.size(); ++k) out[k] += by * d[k];
    return out;
  };
  const auto n = static_cast<Eigen::Index>(r.seconds * r.rate);
  Eigen::VectorXd x(n), y(n), beta(n);
  State s{};
  // Whirl of the linear rotor at the first speed.
  const double w = r.speed(0), stiff = r.k1 - w * w, damp = r.c * w, size = r.e * w * w / std::hypot(stiff, damp);
  const double lag = std::atan2(damp, stiff);
  s[0] = size * std::cos(r.phase - lag), s[1] = -w * size * std::sin(r.phase - lag);
  s[2] = size * std::sin(r.phase - lag), s[3] = w * size * std::cos(r.phase - lag);
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] = felt(s, true) - (r.corner > 0 ? s[5] : 0);
    y[i] = r.gain_y * (felt(s, false) - (r.corner > 0 ? s[6] : 0));
    beta[i] = s[4];
    for (int k = 0; k < kFine; ++k) {
      const State a = rate(s), b = rate(plus(s, h / 2, a)), c = rate(plus(s, h / 2, b)), d = rate(plus(s, h, c));
      for (std::size_t j = 0; j < s.size(); ++j) s[j] += h / 6 * (a[j] + 2 * b[j] + 2 * c[j] + d[j]);
    }
  }
  const auto rms = [](const Eigen::VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); };
  const double share = std::pow(10, -r.noise_db / 20), sx = rms(x), sy = rms(y);
  x.array() += r.offset * sx;
  y.array() += r.offset * sy;
  Recording out;
  out.dt = dt;
  out.source = "sensed";
  out.add("x", r.quantity, x);
  out.add("y", r.quantity, y);
  out.add("beta", Quantity::angle, beta);
  if (clean != nullptr) *clean = out;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  for (Eigen::Index i = 0; i < n; ++i) {
    out.channels[0].samples[i] += share * sx * gauss(random);
    out.channels[1].samples[i] += share * sy * gauss(random);
  }
  return out;
}

}  // namespace whirl::testing
