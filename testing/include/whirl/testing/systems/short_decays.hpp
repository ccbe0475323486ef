#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Short noisy decays of two states from one start: they visit little more than a curve of the state space, along which
/// many sets of terms are alike.
namespace whirl::testing {

struct ShortDecay {
  using State = std::array<double, 2>;
  std::string name;
  std::function<State(const State&)> rate;
  State start;
  double seconds;
  Eigen::Index samples;
  std::array<std::vector<std::string>, 2> terms;  ///< of x' and v', as a cubic library writes them
};

inline std::vector<ShortDecay> short_decays() {
  using State = ShortDecay::State;
  const auto oscillator = [](double k, double c, double k3 = 0) {
    return [=](const State& s) { return State{s[1], -k * s[0] - c * s[1] - k3 * s[0] * s[0] * s[0]}; };
  };
  return {{"overdamped, 1 s", oscillator(50, 15), {1, 0}, 1, 200, {{{"v"}, {"v", "x"}}}},
          {"overdamped, 2 s", oscillator(50, 15), {1, 0}, 2, 200, {{{"v"}, {"v", "x"}}}},
          {"twice overdamped", oscillator(50, 30), {1, 0}, 2, 200, {{{"v"}, {"v", "x"}}}},
          {"critically damped", oscillator(25, 10), {1, 0.5}, 2, 300, {{{"v"}, {"v", "x"}}}},
          {"half a cycle", oscillator(4, 0.4), {1, 0}, 1.6, 120, {{{"v"}, {"v", "x"}}}},
          {"damped hardening spring", oscillator(4, 4, 3), {1, 0}, 3, 200, {{{"v"}, {"v", "x", "x^3"}}}},
          {"node",
           [](const State& s) {
             return State{-s[0] + 0.5 * s[1], -3 * s[1]};
           },
           {1, 1},
           3,
           200,
           {{{"v", "x"}, {"v"}}}}};
}

/// Channels x and v with white noise of `noise` times the spread of each: midpoint steps, 40 and 80 a sample,
/// extrapolated.
inline Recording short_decay_record(const ShortDecay& d, double noise, std::uint64_t seed) {
  using State = ShortDecay::State;
  const double dt = d.seconds / static_cast<double>(d.samples);
  const auto later = [&](State s, int steps) {
    const double h = dt / steps;
    for (int k = 0; k < steps; ++k) {
      const State a = d.rate(s);
      const State b = d.rate({s[0] + 0.5 * h * a[0], s[1] + 0.5 * h * a[1]});
      s = {s[0] + h * b[0], s[1] + h * b[1]};
    }
    return s;
  };
  Eigen::MatrixX2d z(d.samples, 2);
  State s = d.start;
  for (Eigen::Index i = 0; i < d.samples; ++i) {
    z.row(i) << s[0], s[1];
    const State coarse = later(s, 40), fine = later(s, 80);
    s = {fine[0] + (fine[0] - coarse[0]) / 3, fine[1] + (fine[1] - coarse[1]) / 3};
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Recording r;
  r.dt = dt;
  r.source = d.name;
  for (const int column : {0, 1}) {
    Eigen::VectorXd y = z.col(column);
    const double sd = noise * std::sqrt((y.array() - y.mean()).square().mean());
    for (double& value : y) value += sd * normal(random);
    r.add(column == 0 ? "x" : "v", Quantity::dimensionless, y);
  }
  return r;
}

}  // namespace whirl::testing
