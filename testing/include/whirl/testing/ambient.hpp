#pragma once
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A structure under random forces at all its points, with a machine whose speed shows as tones.
struct AmbientOptions {
  std::vector<double> frequency{3.1, 3.131, 5.6, 8.2, 8.282, 11.7, 16.4, 21.3};  ///< Hz: two doublets 1 % apart
  double damping_low = 0.008, damping_high = 0.02;
  int channels = 6;
  double rate = 80, duration = 300;   ///< Hz, s
  std::vector<double> tones{14, 28};  ///< Hz
  double tone_size = 0.3;             ///< peak, relative to the rms of each channel
  double noise = 0.02;                ///< of the sensors, relative to the rms of each channel
  unsigned structure = 1, seed = 1;
};

struct Ambient {
  std::vector<double> frequency, damping;
  std::vector<std::vector<double>> shape;  ///< per mode, per channel
  Recording recording;                     ///< velocities, m/s
};

/// Every mode is stepped exactly (its 2 x 2 state, closed form) at four times the rate under white modal forces that
/// are projections of independent point forces.
inline Ambient make_ambient(const AmbientOptions& o) {
  std::mt19937_64 structure(77ull * o.structure + 3), random(15485863ull * o.seed + o.structure);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Ambient result;
  result.frequency = o.frequency;
  for (std::size_t k = 0; k < o.frequency.size(); ++k) {
    result.damping.push_back(o.damping_low * std::pow(o.damping_high / o.damping_low, uniform(structure)));
    result.shape.emplace_back();
    for (int c = 0; c < o.channels; ++c)
      result.shape.back().push_back((uniform(structure) < 0.5 ? -1 : 1) * (0.2 + 0.8 * uniform(structure)));
  }
  constexpr int kOver = 4;
  const double h = 1 / (o.rate * kOver);
  struct Step {
    double w, zeta, c, s, decay, wd, x = 0, v = 0;
  };
  std::vector<Step> steps;
  for (std::size_t k = 0; k < o.frequency.size(); ++k) {
    Step m{};
    m.w = 2 * std::numbers::pi * o.frequency[k];
    m.zeta = result.damping[k];
    m.wd = m.w * std::sqrt(1 - m.zeta * m.zeta);
    m.decay = std::exp(-m.zeta * m.w * h);
    m.c = std::cos(m.wd * h);
    m.s = std::sin(m.wd * h);
    steps.push_back(m);
  }
  const auto n = static_cast<Eigen::Index>(std::lround(o.rate * o.duration));
  const Eigen::Index settle = static_cast<Eigen::Index>(o.rate * 60);
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(n, o.channels);
  std::vector<double> force(static_cast<std::size_t>(o.channels));
  for (Eigen::Index i = -settle; i < n; ++i) {
    for (int sub = 0; sub < kOver; ++sub) {
      for (double& f : force) f = normal(random);
      for (std::size_t k = 0; k < steps.size(); ++k) {
        Step& m = steps[k];
        double impulse = 0;
        for (std::size_t c = 0; c < force.size(); ++c) impulse += result.shape[k][c] * force[c];
        const double x = m.x, v = m.v + impulse * std::sqrt(h), a = m.zeta * m.w;
        m.x = m.decay * (x * m.c + (v + a * x) / m.wd * m.s);
        m.v = m.decay * (v * m.c - (m.w * m.w * x + a * v) / m.wd * m.s);
      }
    }
    if (i < 0) continue;
    for (int c = 0; c < o.channels; ++c) {
      for (std::size_t k = 0; k < steps.size(); ++k)
        y(i, c) += result.shape[k][static_cast<std::size_t>(c)] * steps[k].v;
    }
  }
  result.recording.dt = 1 / o.rate;
  result.recording.source = "ambient";
  for (int c = 0; c < o.channels; ++c) {
    const double rms = std::sqrt(y.col(c).squaredNorm() / static_cast<double>(n));
    for (std::size_t t = 0; t < o.tones.size(); ++t) {
      const double phase = 2 * std::numbers::pi * uniform(random), size = o.tone_size * rms * (0.5 + uniform(random));
      for (Eigen::Index i = 0; i < n; ++i)
        y(i, c) += size * std::sin(2 * std::numbers::pi * o.tones[t] * static_cast<double>(i) / o.rate + phase);
    }
    for (Eigen::Index i = 0; i < n; ++i) y(i, c) += o.noise * rms * normal(random);
    result.recording.add("v" + std::to_string(c), Quantity::velocity, 1e-3 * y.col(c));
  }
  return result;
}

}  // namespace whirl::testing
