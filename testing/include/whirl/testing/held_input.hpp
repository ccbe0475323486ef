#pragma once
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

/// Systems driven through a D/A converter and a dead time, simulated finely on their own.
namespace whirl::testing {

struct HeldSystem {
  std::string name;
  std::vector<std::string> states;
  std::vector<std::string> library;  ///< candidates; all of the truth's terms among them
  /// rates(x, u)
  std::function<std::vector<double>(const std::vector<double>&, double)> rates;
  double dt = 0.01, amplitude = 1;
  int steps_a_level = 7;  ///< samples between levels of the random staircase
};

/// An input that is constant for some samples, then jumps: values by `seed`.
inline Eigen::VectorXd staircase(Eigen::Index samples, int steps, double amplitude, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> level(-amplitude, amplitude);
  std::uniform_int_distribution<int> length(1, 2 * steps);
  Eigen::VectorXd u(samples);
  double now = 0;
  int left = 0;
  for (Eigen::Index i = 0; i < samples; ++i) {
    if (left-- <= 0) {
      now = level(random);
      left = length(random);
    }
    u[i] = now;
  }
  return u;
}

/// What lies between the samples of the input and the system.
struct Actuator {
  bool ramps = false;  ///< straight lines from sample to sample instead of steps
  double lag = 0;      ///< s: first-order lag behind it
};

/// The system at rest at first, u(t) = sample of t - dead through the actuator: midpoint rule with 600 steps a sample,
/// white noise of `noise` times the spread of each state on top.
inline Recording held_record(const HeldSystem& system, double dead, Eigen::Index samples, double noise, unsigned seed,
                             const Actuator& actuator = {}) {
  constexpr int fine = 300;
  const Eigen::VectorXd u = staircase(samples, system.steps_a_level, system.amplitude, seed);
  double acting = u[0];
  const std::size_t n = system.states.size();
  std::vector<double> x(n, 0.0);
  Eigen::MatrixXd clean(samples, static_cast<Eigen::Index>(n));
  // Steps end where the input switches: past an unstable point a switch at another instant is another motion.
  const double part = dead / system.dt - std::floor(dead / system.dt);
  for (Eigen::Index i = 0; i < samples; ++i) {
    for (std::size_t k = 0; k < n; ++k) clean(i, static_cast<Eigen::Index>(k)) = x[k];
    for (int j = 0; j < 2 * fine; ++j) {
      const double length = j < fine ? part : 1 - part, h = length * system.dt / fine;
      if (length == 0) continue;
      const double middle_of = (j < fine ? 0 : part) + (j % fine + 0.5) * length / fine;
      const double late = std::max(0.0, static_cast<double>(i) + middle_of - dead / system.dt);
      const auto at = static_cast<Eigen::Index>(late);
      double now = u[at];
      if (actuator.ramps) now += (late - std::floor(late)) * (u[std::min(at + 1, samples - 1)] - now);
      acting = actuator.lag > 0 ? now + (acting - now) * std::exp(-h / actuator.lag) : now;
      now = acting;
      const std::vector<double> first = system.rates(x, now);
      std::vector<double> middle = x;
      for (std::size_t k = 0; k < n; ++k) middle[k] += 0.5 * h * first[k];
      const std::vector<double> slope = system.rates(middle, now);
      for (std::size_t k = 0; k < n; ++k) x[k] += h * slope[k];
    }
  }
  Recording r;
  r.dt = system.dt;
  r.source = system.name;
  std::mt19937_64 random(seed * 7919ULL + 17);
  std::normal_distribution<double> gauss;
  for (std::size_t k = 0; k < n; ++k) {
    Eigen::VectorXd y = clean.col(static_cast<Eigen::Index>(k));
    const double sd = noise * std::sqrt((y.array() - y.mean()).square().mean());
    for (double& v : y) v += sd * gauss(random);
    r.add(system.states[k], Quantity::dimensionless, y);
  }
  r.add("u", Quantity::dimensionless, u);
  return r;
}

/// A driven pendulum, a Duffing oscillator and a nonlinear tank.
inline std::vector<HeldSystem> held_systems() {
  return {
      {"pendulum with motor",
       {"a", "w"},
       {"1", "a", "w", "u", "sin(a)", "cos(a)", "a^2", "a*w", "w^2", "u*a", "w^3"},
       [](const std::vector<double>& x, double u) {
         return std::vector<double>{x[1], -22 * std::sin(x[0]) - 1.4 * x[1] + 30 * u};
       },
       0.02,
       0.8,
       9},
      {"Duffing",
       {"x", "v"},
       {},
       [](const std::vector<double>& x, double u) {
         return std::vector<double>{x[1], -9 * x[0] - 14 * x[0] * x[0] * x[0] - 0.7 * x[1] + 12 * u};
       },
       0.02,
       1.5,
       10},
      {"tank with quadratic loss",
       {"q"},
       {},
       [](const std::vector<double>& x, double u) {
         return std::vector<double>{-1.5 * x[0] - 0.9 * x[0] * x[0] + 2.5 * u};
       },
       0.05,
       0.25,  // below -0.25 the level runs away
       6},
  };
}

}  // namespace whirl::testing
