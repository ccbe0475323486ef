#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"

namespace whirl::testing {

/// A structure measured as laboratories do: every FRF sees slightly other natural frequencies.
struct RovingOptions {
  int modes = 12;
  double low = 5, high = 200;  ///< Hz
  double line = 0.0625;        ///< Hz
  int responses = 4, references = 2;
  double frequency_scatter = 0;  ///< relative sd of each natural frequency between FRFs
  double damping_scatter = 0;    ///< sd of each damping ratio between FRFs, relative to it
  double noise = 0.005;          ///< of rms |H|, or of |H(f)| when proportional
  bool proportional = false;
  double common_noise =
      0;  ///< relative error of the force spectrum per line, one draw for all responses to a reference
  double reference_shift = 0;  ///< relative, of all frequencies under every reference after the first
  int modes_above = 3;         ///< modes above the band, the first 5 % above it
  bool hysteretic = false;     ///< k (1 + i eta), eta = 2 zeta, instead of viscous damping
  double damping_low = 0.003, damping_high = 0.015;
  FrfKind kind = FrfKind::accelerance;
  unsigned seed = 1;
};

struct Roving {
  std::vector<double> frequency, damping;  ///< Hz; ratio (half the loss factor when hysteretic), inside the band
  FrequencyResponse frf;
};

/// Sum of single degrees of freedom 1/(w_r^2 - w^2 + 2 i zeta w_r w), evaluated mode by mode in real arithmetic.
inline Roving make_roving(const RovingOptions& o) {
  std::mt19937_64 random(1000003ull * o.seed + 17);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  Roving result;
  std::vector<double> f, z;
  const double gap = (0.97 * o.high - 2 * o.low) / o.modes;
  for (int k = 0; k < o.modes; ++k) f.push_back(2 * o.low + gap * (k + 0.2 + 0.6 * uniform(random)));
  for (int k = 0; k < o.modes_above; ++k) f.push_back(o.high * (1.05 + 0.11 * k + 0.04 * uniform(random)));
  for (std::size_t k = 0; k < f.size(); ++k)
    z.push_back(o.damping_low * std::pow(o.damping_high / o.damping_low, uniform(random)));
  result.frequency.assign(f.begin(), f.begin() + o.modes);
  result.damping.assign(z.begin(), z.begin() + o.modes);
  std::vector<std::vector<double>> shape(f.size());
  for (auto& s : shape) {
    for (int i = 0; i < o.responses + o.references; ++i)
      s.push_back((uniform(random) < 0.5 ? -1 : 1) * (0.25 + 0.75 * uniform(random)));
  }
  const auto lines = static_cast<Eigen::Index>(std::lround((o.high - o.low) / o.line)) + 1;
  result.frf.frequency.resize(lines);
  for (Eigen::Index i = 0; i < lines; ++i) result.frf.frequency[i] = o.low + o.line * static_cast<double>(i);
  result.frf.kind = o.kind;
  for (int r = 0; r < o.references; ++r) {
    Eigen::VectorXcd force_error(lines);
    for (Eigen::Index i = 0; i < lines; ++i)
      force_error[i] = 1.0 + o.common_noise / std::sqrt(2) * std::complex<double>(normal(random), normal(random));
    for (int p = 0; p < o.responses; ++p) {
      FrfChannel channel;
      channel.response = "p" + std::to_string(p);
      channel.reference = "h" + std::to_string(r);
      channel.value = Eigen::VectorXcd::Zero(lines);
      for (std::size_t k = 0; k < f.size(); ++k) {
        const double w0 = 2 * std::numbers::pi * f[k] * (1 + o.frequency_scatter * normal(random)) *
                          (r > 0 ? 1 + o.reference_shift : 1);
        const double zeta = z[k] * (1 + o.damping_scatter * normal(random));
        const double gain = shape[k][static_cast<std::size_t>(p)] * shape[k][static_cast<std::size_t>(o.responses + r)];
        for (Eigen::Index i = 0; i < lines; ++i) {
          const double w = 2 * std::numbers::pi * result.frf.frequency[i];
          const double a = w0 * w0 - w * w, b = 2 * zeta * w0 * (o.hysteretic ? w0 : w), size = a * a + b * b;
          std::complex<double> h(gain * a / size, -gain * b / size);
          if (o.kind == FrfKind::mobility) h = {-w * h.imag(), w * h.real()};
          if (o.kind == FrfKind::accelerance) h *= -w * w;
          channel.value[i] += h;
        }
      }
      const double rms = channel.value.norm() / std::sqrt(static_cast<double>(lines));
      for (Eigen::Index i = 0; i < lines; ++i) {
        const double sd = o.noise * (o.proportional ? std::abs(channel.value[i]) : rms) / std::sqrt(2.0);
        channel.value[i] =
            channel.value[i] * force_error[i] + std::complex<double>(sd * normal(random), sd * normal(random));
      }
      result.frf.channels.push_back(std::move(channel));
    }
  }
  return result;
}

/// A free-free beam struck at its end, with an accelerometer of `mass` (share of the beam's) roving over `points`
/// places: the sensor loads a different place every time. Exact modal sum of 12 bending modes with one added mass.
struct BeamOptions {
  int points = 9;
  double mass = 0.002;  ///< of the sensor, share of the beam's: frequencies fall by up to 2 * mass
  double first = 60;    ///< Hz
  double high = 600, line = 0.25;
  double noise = 0.005;
  unsigned seed = 1;
};

struct Beam {
  std::vector<double> unloaded;            ///< Hz, inside the band
  std::vector<double> frequency, damping;  ///< Hz and ratio with the sensor on, mean of all points
  FrequencyResponse frf;
};

inline Beam make_beam(const BeamOptions& o) {
  constexpr double pi = std::numbers::pi;
  std::mt19937_64 random(7919ull * o.seed + 5);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int count = 12;
  std::vector<double> beta, w, zeta;
  for (int n = 1; n <= count; ++n) {
    double b = (n + 0.5) * pi;  // cosh b cos b = 1, by Newton
    for (int i = 0; i < 20; ++i) b -= (std::cos(b) - 1 / std::cosh(b)) / (-std::sin(b) + std::tanh(b) / std::cosh(b));
    beta.push_back(b);
    w.push_back(2 * pi * o.first * (b / 4.730040745) * (b / 4.730040745));
    zeta.push_back(0.002 + 0.004 * uniform(random));
  }
  const auto shape = [&](int n, double x) {  // of unit modal mass for a beam of mass 1 and length 1
    const double b = beta[static_cast<std::size_t>(n)], s = (std::cosh(b) - std::cos(b)) / (std::sinh(b) - std::sin(b));
    const double e = (1 - s) / 2 * std::exp(b * x) + (1 + s) / 2 * std::exp(-b * x);
    return e + std::cos(b * x) - s * std::sin(b * x);
  };
  Beam result;
  for (double v : w) {
    if (v < 2 * pi * o.high) result.unloaded.push_back(v / (2 * pi));
  }
  result.frequency.assign(result.unloaded.size(), 0);
  result.damping.assign(result.unloaded.size(), 0);
  // The undamped loaded frequency below w[n]: where the sensor's inertia balances, by bisection.
  const auto loaded = [&](double x, std::size_t n) {
    double low = n == 0 ? 1e-3 * w[0] : w[n - 1] * (1 + 1e-9), high = w[n] * (1 - 1e-12);
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      double here = -(1 + 12 * (x - 0.5) * (x - 0.5)) / (middle * middle);
      for (int k = 0; k < count; ++k) {
        const double wk = w[static_cast<std::size_t>(k)];
        here += shape(k, x) * shape(k, x) / (wk * wk - middle * middle);
      }
      (1 - o.mass * middle * middle * here > 0 ? low : high) = middle;
    }
    return high;
  };
  const auto lines = static_cast<Eigen::Index>(std::lround(o.high / o.line));
  result.frf.frequency.resize(lines);
  for (Eigen::Index i = 0; i < lines; ++i) result.frf.frequency[i] = o.line * static_cast<double>(i + 1);
  result.frf.kind = FrfKind::accelerance;
  for (int p = 0; p < o.points; ++p) {
    const double x = (p + 0.5) / o.points + 0.02 * (uniform(random) - 0.5);
    FrfChannel channel;
    channel.response = "b" + std::to_string(p);
    channel.reference = "end";
    channel.value.resize(lines);
    for (std::size_t n = 0; n < result.unloaded.size(); ++n) {
      const double seen = loaded(x, n);
      result.frequency[n] += seen / (2 * pi) / o.points;
      result.damping[n] += zeta[n] * seen / w[n] / o.points;  // the sensor adds mass, no damping
    }
    for (Eigen::Index i = 0; i < lines; ++i) {
      const double omega = 2 * pi * result.frf.frequency[i];
      const std::complex<double> rigid(-1 / (omega * omega));
      std::complex<double> here = rigid * (1 + 12 * (x - 0.5) * (x - 0.5));      // receptance at the sensor
      std::complex<double> across = rigid * (1 + 12 * (x - 0.5) * (0.0 - 0.5));  // and from the end to it
      for (int n = 0; n < count; ++n) {
        const auto k = static_cast<std::size_t>(n);
        const std::complex<double> one =
            1.0 / std::complex<double>(w[k] * w[k] - omega * omega, 2 * zeta[k] * w[k] * omega);
        here += shape(n, x) * shape(n, x) * one;
        across += shape(n, x) * shape(n, 0) * one;
      }
      // The sensor's inertia force acts back: y = across F + here (m w^2 y).
      channel.value[i] = -omega * omega * across / (1.0 - o.mass * omega * omega * here);
    }
    const double rms = channel.value.norm() / std::sqrt(static_cast<double>(lines));
    for (Eigen::Index i = 0; i < lines; ++i)
      channel.value[i] += o.noise * rms / std::sqrt(2.0) * std::complex<double>(normal(random), normal(random));
    result.frf.channels.push_back(std::move(channel));
  }
  return result;
}

}  // namespace whirl::testing
