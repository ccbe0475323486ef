#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::testing {

/// A machine on its foundation under random forces, whose speed wanders while its orders shake the structure.
struct WanderingOptions {
  int channels = 6;
  double rate = 100, duration = 400;               ///< Hz, s
  double least_wander = 5e-4, most_wander = 1e-2;  ///< relative sd of the speed, drawn between (logarithm)
  bool running = true;                             ///< false: the same structure with the machine at rest
  double beside = 0;                               ///< not 0: 1X stands so far beside a mode, relative
  bool tacho = false;                              ///< the record holds the rotor's angle
  double least_damping = 0.003, most_damping = 0.03;
  double least_size = 0.2, most_size = 2;  ///< peak of an order over the rms of the channel that it shakes most
  unsigned seed = 1;
};

struct WanderingMachine {
  std::vector<double> frequency, damping;  ///< of the modes: Hz; ratio
  std::vector<double> order;               ///< multiples of the speed that shake
  double speed = 0, wander = 0;            ///< Hz, mean; relative sd
  Recording recording;                     ///< accelerations, m/s^2
};

namespace wandering {

/// Relative speed deviations of unit sd, one per sample: hunting, slow drift, or filtered noise, drawn.
inline std::vector<double> draw_wander(std::size_t n, double dt, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const int kind = static_cast<int>(3 * uniform(random));
  const double memory = 4 * std::pow(15, uniform(random)), period = 15 * std::pow(8, uniform(random));
  const double keep = std::exp(-dt / memory), kick = std::sqrt(1 - keep * keep);
  std::vector<double> u(n);
  double noise = normal(random), phase = 2 * std::numbers::pi * uniform(random);
  for (std::size_t i = 0; i < n; ++i) {
    noise = keep * noise + kick * normal(random);
    const double t = static_cast<double>(i) * dt, part = static_cast<double>(i) / static_cast<double>(n);
    if (kind == 0) u[i] = noise;
    if (kind == 1) u[i] = 1.4 * std::sin(2 * std::numbers::pi * t / period + phase) + 0.3 * noise;
    if (kind == 2) u[i] = 3 * (part - 0.5) + 0.5 * noise;
  }
  double mean = 0, square = 0;
  for (const double v : u) mean += v / static_cast<double>(n);
  for (const double v : u) square += (v - mean) * (v - mean) / static_cast<double>(n);
  for (double& v : u) v = (v - mean) / std::sqrt(square);
  return u;
}

/// One mode stepped exactly between impulses; displacement and velocity.
struct Oscillator {
  double w, zeta, c, s, decay, wd, x = 0, v = 0;

  Oscillator(double frequency, double damping, double h) : w(2 * std::numbers::pi * frequency), zeta(damping) {
    wd = w * std::sqrt(1 - zeta * zeta);
    decay = std::exp(-zeta * w * h);
    c = std::cos(wd * h);
    s = std::sin(wd * h);
  }
  void step(double impulse) {
    const double x0 = x, v0 = v + impulse, a = zeta * w;
    x = decay * (x0 * c + (v0 + a * x0) / wd * s);
    v = decay * (v0 * c - (w * w * x0 + a * v0) / wd * s);
  }
  double acceleration() const { return -w * w * x - 2 * zeta * w * v; }
};

}  // namespace wandering

/// Three to six modes from 3 to 38 Hz, at least 5 % apart; every order is a force at one point of the structure and
/// passes through its modes like the random forces, so that its size and phase follow the speed.
inline WanderingMachine make_wandering_machine(const WanderingOptions& o) {
  std::mt19937_64 random(48271ull * o.seed + 11);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const auto drawn_log = [&](double a, double b) { return a * std::pow(b / a, uniform(random)); };
  WanderingMachine m;
  const auto modes = static_cast<std::size_t>(3 + 4 * uniform(random) - 1e-9);
  while (m.frequency.size() < modes) {
    const double f = drawn_log(3, 38);
    if (std::all_of(m.frequency.begin(), m.frequency.end(), [&](double g) { return std::abs(std::log(f / g)) > 0.05; }))
      m.frequency.push_back(f);
  }
  std::sort(m.frequency.begin(), m.frequency.end());
  std::vector<std::vector<double>> shape(modes);
  for (auto& s : shape) {
    m.damping.push_back(drawn_log(o.least_damping, o.most_damping));
    for (int c = 0; c <= o.channels; ++c)  // the last point is that of the machine
      s.push_back((uniform(random) < 0.5 ? -1 : 1) * (0.2 + 0.8 * uniform(random)));
  }
  m.speed = drawn_log(6, 22);
  const double beside = m.frequency[static_cast<std::size_t>(uniform(random) * static_cast<double>(modes))];
  if (o.beside != 0) m.speed = beside * (1 + o.beside);
  m.wander = drawn_log(o.least_wander, o.most_wander);
  for (const double order : {1.0, 2.0, uniform(random) < 0.3 ? 0.5 : 3.0, uniform(random) < 0.5 ? 4.0 : 5.0})
    if (order * m.speed < 0.42 * o.rate) m.order.push_back(order);
  std::vector<double> size;
  for (std::size_t k = 0; k < m.order.size(); ++k) size.push_back(drawn_log(o.least_size, o.most_size));

  constexpr int kSteps = 6;
  const double h = 1 / (o.rate * kSteps);
  const auto n = static_cast<Eigen::Index>(std::lround(o.rate * o.duration)),
             settle = static_cast<Eigen::Index>(40 * o.rate);
  const auto channels = static_cast<std::size_t>(o.channels);
  const std::vector<double> wander = wandering::draw_wander(static_cast<std::size_t>(n + settle) * kSteps, h, random);
  // Rows: random forces, then each order.
  std::vector<std::vector<wandering::Oscillator>> state(1 + m.order.size());
  for (auto& row : state)
    for (std::size_t k = 0; k < modes; ++k) row.emplace_back(m.frequency[k], m.damping[k], h);
  std::vector<Eigen::MatrixXd> part(state.size(), Eigen::MatrixXd::Zero(n, o.channels));
  Eigen::VectorXd angle(n);
  std::vector<double> force(channels), start(m.order.size());
  for (double& phase : start) phase = 2 * std::numbers::pi * uniform(random);
  double turned = 0;
  std::size_t at = 0;
  for (Eigen::Index i = -settle; i < n; ++i) {
    for (int sub = 0; sub < kSteps; ++sub, ++at) {
      const double speed = m.speed * (1 + m.wander * wander[at]);
      turned += 2 * std::numbers::pi * speed * h;
      for (double& f : force) f = normal(random);
      for (std::size_t k = 0; k < modes; ++k) {
        double impulse = 0;
        for (std::size_t c = 0; c < channels; ++c) impulse += shape[k][c] * force[c];
        state[0][k].step(impulse * std::sqrt(h));
        for (std::size_t q = 0; q < m.order.size(); ++q)
          state[1 + q][k].step(shape[k][channels] * std::cos(m.order[q] * turned + start[q]) * h);
      }
    }
    if (i < 0) continue;
    angle[i] = turned;
    for (std::size_t row = 0; row < state.size(); ++row) {
      for (std::size_t k = 0; k < modes; ++k) {
        const double a = state[row][k].acceleration();
        for (std::size_t c = 0; c < channels; ++c) part[row](i, static_cast<Eigen::Index>(c)) += shape[k][c] * a;
      }
    }
  }
  Eigen::MatrixXd y = part[0];
  const Eigen::RowVectorXd rms = (y.colwise().squaredNorm() / static_cast<double>(n)).cwiseSqrt();
  for (std::size_t q = 0; q < m.order.size() && o.running; ++q) {
    const Eigen::RowVectorXd peak = (2 * part[1 + q].colwise().squaredNorm() / static_cast<double>(n)).cwiseSqrt();
    y += part[1 + q] * (size[q] / peak.cwiseQuotient(rms).maxCoeff());
  }
  m.recording.dt = 1 / o.rate;
  m.recording.source = "machine";
  for (Eigen::Index c = 0; c < o.channels; ++c) {
    for (Eigen::Index i = 0; i < n; ++i) y(i, c) += 0.02 * rms[c] * normal(random);
    m.recording.add("a" + std::to_string(c), Quantity::acceleration, y.col(c));
  }
  if (o.tacho) m.recording.add("beta", Quantity::angle, angle);
  if (!o.running) m.order.clear();
  return m;
}

/// What became of the modes and orders of a machine. `Found`: modes with estimates of frequency and damping, tones.
struct WanderingScore {
  int found = 0;        ///< true modes with one listed within 1 % or three of its standard deviations
  int orders = 0;       ///< listed modes that stand at an order and at no mode
  int other = 0;        ///< further listed modes
  int false_tones = 0;  ///< tones that stand at no order
  int frequency_covered = 0, damping_covered = 0;
  std::vector<double> damping_deviations;  ///< error over the standard deviation stated
};

template <class Found>
WanderingScore score(const WanderingMachine& truth, const Found& listed) {
  WanderingScore result;
  std::vector<bool> used(listed.modes.size());
  for (std::size_t k = 0; k < truth.frequency.size(); ++k) {
    std::size_t best = used.size();
    double least = INFINITY;
    for (std::size_t i = 0; i < used.size(); ++i) {
      const auto& f = listed.modes[i].frequency;
      const double off = std::abs(f.value - truth.frequency[k]);
      if (used[i] || off > std::max(0.01 * truth.frequency[k], 3 * f.sd) || off >= least) continue;
      least = off;
      best = i;
    }
    if (best == used.size()) continue;
    used[best] = true;
    ++result.found;
    const auto& zeta = listed.modes[best].damping;
    result.frequency_covered += listed.modes[best].frequency.covers(truth.frequency[k]);
    result.damping_covered += zeta.covers(truth.damping[k]);
    result.damping_deviations.push_back((zeta.value - truth.damping[k]) / zeta.sd);
  }
  const auto at_order = [&](double f) {
    return std::any_of(truth.order.begin(), truth.order.end(), [&](double order) {
      return std::abs(f / (order * truth.speed) - 1) < std::max(0.01, 3 * truth.wander);
    });
  };
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) continue;
    ++(at_order(listed.modes[i].frequency.value) ? result.orders : result.other);
  }
  for (const auto& tone : listed.tones) result.false_tones += !at_order(tone.frequency);
  return result;
}

}  // namespace whirl::testing
