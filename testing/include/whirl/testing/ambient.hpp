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
  double uneven = 0;                  ///< spread (sd of the logarithm) of the forces at the points, drawn by the seed
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
  std::vector<double> force(static_cast<std::size_t>(o.channels)), size(force.size(), 1.0);
  if (o.uneven > 0) {
    for (double& one : size) one = std::exp(o.uneven * normal(random));
  }
  for (Eigen::Index i = -settle; i < n; ++i) {
    for (int sub = 0; sub < kOver; ++sub) {
      for (std::size_t c = 0; c < force.size(); ++c) force[c] = size[c] * normal(random);
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
      const double phase = 2 * std::numbers::pi * uniform(random), peak = o.tone_size * rms * (0.5 + uniform(random));
      for (Eigen::Index i = 0; i < n; ++i)
        y(i, c) += peak * std::sin(2 * std::numbers::pi * o.tones[t] * static_cast<double>(i) / o.rate + phase);
    }
    for (Eigen::Index i = 0; i < n; ++i) y(i, c) += o.noise * rms * normal(random);
    result.recording.add("v" + std::to_string(c), Quantity::velocity, 1e-3 * y.col(c));
  }
  return result;
}

/// An ambient test with few sensors: two stay (references), the others move on from record to record.
struct RovingSetupsOptions {
  int setups = 3, references = 2, moving = 4;
  double level_spread = 0.5;    ///< sd of the logarithm of the forces' size from set-up to set-up
  double uneven = 0.7;          ///< of the forces at the points
  double frequency_spread = 0;  ///< relative sd of all frequencies from set-up to set-up (warming)
  double duration = 300;
  unsigned structure = 1, seed = 1;
};

struct RovingSetups {
  std::vector<double> frequency, damping;  ///< of the first set-up's modes before any spread
  std::vector<std::vector<double>> shape;  ///< per mode: references first, then the points in the order of the set-ups
  std::vector<Recording> records;
};

/// Each set-up is a record of its own time: other forces, other size and direction of them, other noise.
inline RovingSetups make_roving_setups(const RovingSetupsOptions& o) {
  RovingSetups result;
  std::mt19937_64 random(32452843ull * o.seed + 17ull * o.structure);
  std::normal_distribution<double> normal;
  for (int s = 0; s < o.setups; ++s) {
    AmbientOptions a;
    a.structure = o.structure;
    a.seed = 100 * o.seed + static_cast<unsigned>(s);
    a.channels = o.references + o.setups * o.moving;
    a.duration = o.duration;
    a.uneven = o.uneven;
    if (s == 0) result.frequency = a.frequency;
    const double factor = 1 + o.frequency_spread * normal(random), level = std::exp(o.level_spread * normal(random));
    for (double& f : a.frequency) f *= factor;
    const Ambient whole = make_ambient(a);
    if (s == 0) {
      result.damping = whole.damping;
      result.shape = whole.shape;
    }
    Recording record;
    record.dt = whole.recording.dt;
    record.source = "set-up " + std::to_string(s + 1);
    for (int c = 0; c < a.channels; ++c) {
      const bool reference = c < o.references;
      if (!reference && (c - o.references) / o.moving != s) continue;
      record.add((reference ? "ref" : "p") + std::to_string(c), Quantity::velocity,
                 level * whole.recording.channels[static_cast<std::size_t>(c)].samples);
    }
    result.records.push_back(std::move(record));
  }
  return result;
}

}  // namespace whirl::testing
