#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

enum class ShakerForce { random, burst, sweep, periodic };

/// A test with shakers as a front end records it.
struct ShakerTest {
  ShakerForce force = ShakerForce::random;
  int forces = 1, responses = 3;
  int modes_low = 3, modes_high = 8;
  double rate = 512, seconds = 60;
  double damping_low = 0.005, damping_high = 0.02;
  double noise = 0.01;     ///< of every response, rms
  double force_noise = 0;  ///< of every force, rms
  int records = 1;
  unsigned seed = 1;
};

struct ShakerRecords {
  std::vector<double> frequency, damping;
  std::vector<Recording> records;
};

namespace shaker_detail {

/// Windowed sinc below 0.4 of the rate, at `fine` times the rate.
inline std::vector<double> low_pass(int fine) {
  std::vector<double> taps;
  const int half = 24 * fine;
  for (int i = -half; i <= half; ++i) {
    const double x = 0.8 * i / fine, w = std::cos(0.5 * std::numbers::pi * i / (half + 1));
    taps.push_back((i == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x)) * w * w);
  }
  return taps;
}

/// One force at the fine rate.
inline std::vector<double> force_of(const ShakerTest& o, int fine, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const double dt = 1 / (o.rate * fine);
  const auto n = static_cast<std::size_t>(o.seconds * o.rate) * static_cast<std::size_t>(fine);
  std::vector<double> force(n, 0.0);
  if (o.force == ShakerForce::sweep) {
    const double last = 0.38 * o.rate, rise = (last - 2) / o.seconds;
    for (std::size_t i = 0; i < n; ++i) {
      const double t = dt * static_cast<double>(i);
      force[i] = 20 * std::sin(2 * std::numbers::pi * (2 * t + 0.5 * rise * t * t));
    }
    return force;
  }
  // A new random number per sample, shaped by the filter: a sum of its pulses.
  const std::vector<double> taps = low_pass(fine);
  const auto period = static_cast<std::size_t>(8 * o.rate), samples = n / static_cast<std::size_t>(fine);
  std::vector<double> drawn;
  for (std::size_t i = 0; i < samples; ++i) {
    const bool quiet = o.force == ShakerForce::burst && i % period > period * 6 / 10;
    if (o.force == ShakerForce::periodic && i >= period)
      drawn.push_back(drawn[i - period]);
    else
      drawn.push_back(quiet ? 0 : 10 * normal(random));
  }
  const long half = static_cast<long>(taps.size()) / 2;
  for (std::size_t i = 0; i < samples; ++i) {
    const long centre = static_cast<long>(i) * fine;
    for (long k = -half; k <= half; ++k) {
      const long at = centre + k;
      if (at >= 0 && at < static_cast<long>(n))
        force[static_cast<std::size_t>(at)] += drawn[i] * taps[static_cast<std::size_t>(k + half)];
    }
  }
  return force;
}

}  // namespace shaker_detail

/// Single degrees of freedom from rest under forces that are straight lines between instants sixteen to a sample, each
/// solved exactly; every sixteenth instant is recorded. Accelerations.
inline ShakerRecords make_shaker_records(const ShakerTest& o) {
  using Complex = std::complex<double>;
  constexpr int kFine = 16;
  std::mt19937_64 random(48611ull * o.seed + 29);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  ShakerRecords result;
  const int modes = o.modes_low + static_cast<int>(uniform(random) * (o.modes_high - o.modes_low + 0.999));
  std::vector<std::vector<double>> shape(static_cast<std::size_t>(modes));
  const double low = 0.02 * o.rate, high = 0.32 * o.rate;
  for (int k = 0; k < modes; ++k) {
    result.frequency.push_back(low + (high - low) * (k + 0.1 + 0.8 * uniform(random)) / modes);
    result.damping.push_back(o.damping_low * std::pow(o.damping_high / o.damping_low, uniform(random)));
    for (int i = 0; i < o.responses + o.forces; ++i)
      shape[static_cast<std::size_t>(k)].push_back((uniform(random) < 0.5 ? -1 : 1) * (0.3 + 0.7 * uniform(random)));
  }
  const double h = 1 / (o.rate * kFine);
  for (int r = 0; r < o.records; ++r) {
    std::vector<std::vector<double>> forces;
    for (int j = 0; j < o.forces; ++j) forces.push_back(shaker_detail::force_of(o, kFine, random));
    const auto samples = static_cast<Eigen::Index>(forces.front().size() / kFine);
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(samples, o.responses);
    for (int k = 0; k < modes; ++k) {
      const auto& s = shape[static_cast<std::size_t>(k)];
      const double w = 2 * std::numbers::pi * result.frequency[static_cast<std::size_t>(k)];
      const double zeta = result.damping[static_cast<std::size_t>(k)];
      const Complex p = w * Complex(-zeta, std::sqrt(1 - zeta * zeta)), e = std::exp(p * h);
      const Complex before = (e * (p * h - 1.0) + 1.0) / (p * p * h), after = (e - 1.0 - p * h) / (p * p * h);
      const Complex residue = 1.0 / (p - std::conj(p));
      Complex q = 0;
      const auto pushed = [&](std::size_t i) {
        double f = 0;
        for (int j = 0; j < o.forces; ++j)
          f += s[static_cast<std::size_t>(o.responses + j)] * forces[static_cast<std::size_t>(j)][i];
        return f;
      };
      double old = pushed(0);
      for (std::size_t i = 0; i < forces.front().size(); ++i) {
        if (i > 0) {
          const double now = pushed(i);
          q = e * q + before * old + after * now;
          old = now;
        }
        if (i % kFine != 0) continue;
        // x'' = f - 2 zeta w x' - w^2 x with x = 2 Re(residue q), x' = 2 Re(p residue q).
        const double x = 2 * (residue * q).real(), v = 2 * (p * residue * q).real();
        const double a = old - 2 * zeta * w * v - w * w * x;
        for (int c = 0; c < o.responses; ++c)
          moved(static_cast<Eigen::Index>(i / kFine), c) += s[static_cast<std::size_t>(c)] * a;
      }
    }
    Recording record;
    record.dt = 1 / o.rate;
    record.source = "shaker";
    const auto noisy = [&](Eigen::VectorXd v, double part) {
      const double sd = part * std::sqrt(v.squaredNorm() / static_cast<double>(v.size()));
      for (double& x : v) x += sd * normal(random);
      return v;
    };
    for (int j = 0; j < o.forces; ++j) {
      Eigen::VectorXd f(samples);
      for (Eigen::Index i = 0; i < samples; ++i)
        f[i] = forces[static_cast<std::size_t>(j)][static_cast<std::size_t>(i * kFine)];
      record.add("force_" + std::to_string(j + 1), Quantity::force, noisy(f, o.force_noise));
    }
    for (int c = 0; c < o.responses; ++c)
      record.add("acc_" + std::to_string(c + 1), Quantity::acceleration, noisy(moved.col(c), o.noise));
    result.records.push_back(std::move(record));
  }
  return result;
}

}  // namespace whirl::testing
