#pragma once
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "whirl/core/recording.hpp"

/// Systems with a state that no channel shows, simulated finely on their own.
namespace whirl::testing {

/// Sum of cosines with random phases on a grid of `df` Hz between two frequencies.
class Multisine {
 public:
  Multisine(double low_hz, double high_hz, double df, double rms, unsigned seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> phase(0, 2 * std::numbers::pi);
    for (double f = low_hz; f <= high_hz; f += df) {
      w_.push_back(2 * std::numbers::pi * f);
      phase_.push_back(phase(random));
    }
    amplitude_ = rms * std::sqrt(2.0 / static_cast<double>(w_.size()));
  }
  double operator()(double t) const {
    double sum = 0;
    for (std::size_t k = 0; k < w_.size(); ++k) sum += std::cos(w_[k] * t + phase_[k]);
    return amplitude_ * sum;
  }

 private:
  std::vector<double> w_, phase_;
  double amplitude_ = 0;
};

/// The hysteretic benchmark of Noel and Schoukens (2016), noise free: m y'' + c y' + k y + z = u,
/// z' = alpha y' - beta (gamma |y'| |z|^(nu-1) z + delta y' |z|^nu) with nu = 1; 750 Hz.
inline Recording bouc_wen_record(Eigen::Index samples, double rms, unsigned seed, double low = 5, double high = 150) {
  const double m = 2, c = 10, k = 5e4, alpha = 5e4, beta = 1e3, gamma = 0.8, delta = -1.1;
  const int fine = 20;
  const double dt = 1.0 / 750, h = dt / fine;
  const Multisine force(low, high, 1.3, rms, seed);
  const auto rate = [&](const double* s, double u, double* r) {
    r[0] = s[1];
    r[1] = (u - c * s[1] - k * s[0] - s[2]) / m;
    r[2] = alpha * s[1] - beta * (gamma * std::abs(s[1]) * s[2] + delta * s[1] * std::abs(s[2]));
  };
  Eigen::VectorXd y(samples), u(samples);
  double s[3] = {0, 0, 0};
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double t0 = dt * static_cast<double>(i);
    y[i] = s[0];
    u[i] = force(t0);
    for (int j = 0; j < fine; ++j) {
      const double t = t0 + h * j, u0 = force(t), um = force(t + 0.5 * h), u1 = force(t + h);
      double a[3], b[3], d[3], e[3], at[3];
      rate(s, u0, a);
      for (int q = 0; q < 3; ++q) at[q] = s[q] + 0.5 * h * a[q];
      rate(at, um, b);
      for (int q = 0; q < 3; ++q) at[q] = s[q] + 0.5 * h * b[q];
      rate(at, um, d);
      for (int q = 0; q < 3; ++q) at[q] = s[q] + h * d[q];
      rate(at, u1, e);
      for (int q = 0; q < 3; ++q) s[q] += h / 6 * (a[q] + 2 * (b[q] + d[q]) + e[q]);
    }
  }
  Recording r;
  r.dt = dt;
  r.source = "Bouc-Wen";
  r.add("y", Quantity::displacement, y);
  r.add("u", Quantity::force, u);
  return r;
}

/// A mass on a spring behind an actuator that follows its command with a lag of 1 / `rate` s: x'' = -900 x - 3 x' -
/// 4e4 x^3 + 50 h, h' = rate (u - h); 1 kHz, displacement noise of `noise` times its spread.
inline Recording lagging_actuator_record(Eigen::Index samples, double rate, double noise, unsigned seed) {
  const Multisine command(0.5, 12, 0.37, 1, seed);
  const double dt = 2e-3;
  const int fine = 50;  // midpoint rule
  Eigen::VectorXd x(samples), u(samples);
  double s[3] = {0, 0, 0};
  for (Eigen::Index i = 0; i < samples; ++i) {
    x[i] = s[0];
    u[i] = command(dt * static_cast<double>(i));
    for (int j = 0; j < fine; ++j) {
      const double h = dt / fine, c = command(dt * (static_cast<double>(i) + (j + 0.5) / fine));
      const auto slope = [&](const double* at, double* r) {
        r[0] = at[1];
        r[1] = -900 * at[0] - 3 * at[1] - 4e4 * at[0] * at[0] * at[0] + 50 * at[2];
        r[2] = rate * (c - at[2]);
      };
      double a[3], b[3], at[3];
      slope(s, a);
      for (int q = 0; q < 3; ++q) at[q] = s[q] + 0.5 * h * a[q];
      slope(at, b);
      for (int q = 0; q < 3; ++q) s[q] += h * b[q];
    }
  }
  std::mt19937_64 random(seed + 1000003ULL);
  std::normal_distribution<double> gauss;
  const double sd = noise * std::sqrt((x.array() - x.mean()).square().mean());
  for (double& v : x) v += sd * gauss(random);
  Recording r;
  r.dt = dt;
  r.source = "lagging actuator";
  r.add("x", Quantity::displacement, x);
  r.add("u", Quantity::force, u);
  return r;
}

}  // namespace whirl::testing
