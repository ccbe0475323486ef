#pragma once
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/simulate_model.hpp"

/// Systems with known equations, simulated finely: what an identification must give back.
namespace whirl::testing {

struct ZooSystem {
  std::string name;
  IdentifiedModel truth;
  std::vector<double> start;
  double dt = 0.01;
  Eigen::Index samples = 0;
  std::vector<std::string> library;     ///< empty: the default one
  std::function<double(double)> input;  ///< of t, when the truth has an input "u"
};

inline IdentifiedModel zoo_model(
    const std::vector<std::pair<std::string, std::vector<std::pair<double, std::string>>>>& equations,
    std::vector<std::string> inputs = {}) {
  IdentifiedModel m;
  for (auto& [state, terms] : equations) {
    m.states.push_back(state);
    Equation e{state + "'", {}};
    for (auto& [value, function] : terms) e.terms.push_back({function, {value, 0, value, value}, ""});
    m.equations.push_back(e);
  }
  m.inputs = std::move(inputs);
  return m;
}

/// Canonical systems with their usual parameters (Brunton et al. 2016; Messenger and Bortz 2021; Strogatz 1994).
inline std::vector<ZooSystem> zoo() {
  const std::vector<std::string> pendulum_library{"1",   "x",   "v",   "sin(x)", "cos(x)", "x^2",
                                                  "x*v", "v^2", "x^3", "x^2*v",  "x*v^2",  "v^3"};
  IdentifiedModel lorenz96 = [] {
    std::vector<std::pair<std::string, std::vector<std::pair<double, std::string>>>> e;
    const auto x = [](int i) { return "x" + std::to_string((i + 5) % 5 + 1); };
    for (int i = 0; i < 5; ++i) {
      e.push_back({x(i), {{1, x(i + 1) + "*" + x(i - 1)}, {-1, x(i - 2) + "*" + x(i - 1)}, {-1, x(i)}, {8, "1"}}});
    }
    return zoo_model(e);
  }();
  return {
      {"linear",
       zoo_model({{"x", {{-0.1, "x"}, {2, "y"}}}, {"y", {{-2, "x"}, {-0.1, "y"}}}}),
       {2, 0},
       0.02,
       1250,
       {},
       {}},
      {"cubic",
       zoo_model({{"x", {{-0.1, "x^3"}, {2, "y^3"}}}, {"y", {{-2, "x^3"}, {-0.1, "y^3"}}}}),
       {2, 0},
       0.01,
       2500,
       {},
       {}},
      {"Van der Pol",
       zoo_model({{"x", {{1, "y"}}}, {"y", {{-1, "x"}, {2, "y"}, {-2, "x^2*y"}}}}),
       {2, 0},
       0.02,
       2000,
       {},
       {}},
      {"Lotka-Volterra",
       zoo_model({{"x", {{1.5, "x"}, {-1, "x*y"}}}, {"y", {{-3, "y"}, {1, "x*y"}}}}),
       {2, 1},
       0.01,
       2500,
       {},
       {}},
      {"Duffing free",
       zoo_model({{"x", {{1, "v"}}}, {"v", {{-0.2, "v"}, {-1, "x"}, {-2, "x^3"}}}}),
       {2, 0},
       0.02,
       2000,
       {},
       {}},
      {"Duffing forced",
       zoo_model({{"x", {{1, "v"}}}, {"v", {{-0.3, "v"}, {1, "x"}, {-1, "x^3"}, {1, "u"}}}}, {"u"}),
       {1, 0},
       0.02,
       4000,
       {},
       [](double t) { return 0.5 * std::cos(1.2 * t); }},
      {"Hopf",
       zoo_model({{"x", {{0.5, "x"}, {-1, "y"}, {-1, "x^3"}, {-1, "x*y^2"}}},
                  {"y", {{1, "x"}, {0.5, "y"}, {-1, "x^2*y"}, {-1, "y^3"}}}}),
       {2, 0},
       0.02,
       2000,
       {},
       {}},
      {"pendulum",
       zoo_model({{"x", {{1, "v"}}}, {"v", {{-0.1, "v"}, {-4, "sin(x)"}}}}),
       {2.8, 0},
       0.01,
       3000,
       pendulum_library,
       {}},
      {"Lorenz",
       zoo_model({{"x", {{-10, "x"}, {10, "y"}}},
                  {"y", {{28, "x"}, {-1, "y"}, {-1, "x*z"}}},
                  {"z", {{-8.0 / 3, "z"}, {1, "x*y"}}}}),
       {-8, 7, 27},
       0.005,
       4000,
       {},
       {}},
      {"Roessler",
       zoo_model({{"x", {{-1, "y"}, {-1, "z"}}},
                  {"y", {{1, "x"}, {0.2, "y"}}},
                  {"z", {{0.2, "1"}, {-5.7, "z"}, {1, "x*z"}}}}),
       {3, 5, 0.1},
       0.02,
       6000,
       {},
       {}},
      {"Lorenz-96", lorenz96, {1, 8, 4, 3, 6}, 0.005, 4000, {}, {}},
  };
}

/// All monomials up to degree 3, as text.
inline std::vector<std::string> cubic_terms(const std::vector<std::string>& x) {
  std::vector<std::string> terms{"1"};
  for (std::size_t i = 0; i < x.size(); ++i) {
    terms.push_back(x[i]);
    for (std::size_t j = i; j < x.size(); ++j) {
      terms.push_back(x[i] + "*" + x[j]);
      for (std::size_t k = j; k < x.size(); ++k) terms.push_back(x[i] + "*" + x[j] + "*" + x[k]);
    }
  }
  return terms;
}

/// Systems whose search is long: four states with all 35 terms of degree 3, and chaos with rare bursts.
inline std::vector<ZooSystem> wide_zoo() {
  const std::vector<std::string> all = cubic_terms({"x", "v", "y", "w"});
  return {
      {"rotor, free",
       zoo_model({{"x", {{1, "v"}}},
                  {"v", {{-25, "x"}, {-0.3, "v"}, {-40, "x^3"}, {-40, "x*y^2"}}},
                  {"y", {{1, "w"}}},
                  {"w", {{-25, "y"}, {-0.3, "w"}, {-40, "x^2*y"}, {-40, "y^3"}}}}),
       {0.6, 0, 0, 2.2},
       0.01,
       1500,
       all,
       {}},
      {"coupled oscillators",  // Van der Pol drives Duffing
       zoo_model({{"x", {{1, "v"}}},
                  {"v", {{-1, "x"}, {2, "v"}, {-2, "x^2*v"}, {0.5, "y"}}},
                  {"y", {{1, "w"}}},
                  {"w", {{-2, "y"}, {-0.2, "w"}, {-1, "y^3"}, {0.5, "x"}}}}),
       {2, 0, 1, 0},
       0.02,
       2500,
       all,
       {}},
      {"Roessler, c = 14",
       zoo_model(
           {{"x", {{-1, "y"}, {-1, "z"}}}, {"y", {{1, "x"}, {0.1, "y"}}}, {"z", {{0.1, "1"}, {-14, "z"}, {1, "x*z"}}}}),
       {5, 5, 0.1},
       0.02,
       6000,
       {},
       {}},
  };
}

/// The record of a system, integrated with 10 Runge-Kutta steps per sample, with white noise of `noise` times the rms
/// of each state (about its mean). Inputs are exact.
inline Recording zoo_record(const ZooSystem& s, double noise, std::uint64_t seed) {
  constexpr Eigen::Index fine = 10;
  const identification::CompiledModel model(s.truth);
  const Eigen::Index steps = (s.samples - 1) * fine + 1;
  Eigen::MatrixXd inputs(2 * steps - 1, static_cast<Eigen::Index>(model.inputs().size()));
  for (Eigen::Index i = 0; i < inputs.rows() && inputs.cols() > 0; ++i) {
    inputs(i, 0) = s.input(0.5 * s.dt / fine * static_cast<double>(i));
  }
  const Eigen::VectorXd start =
      Eigen::Map<const Eigen::VectorXd>(s.start.data(), static_cast<Eigen::Index>(s.start.size()));
  const identification::ModelRun run = simulate(model, inputs, start, s.dt / fine, steps);
  Recording r;
  r.dt = s.dt;
  r.source = s.name;
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < run.states.size(); ++k) {
    Eigen::VectorXd x(s.samples);
    for (Eigen::Index i = 0; i < s.samples; ++i) x[i] = run.values(i * fine, static_cast<Eigen::Index>(k));
    const double sd = std::sqrt((x.array() - x.mean()).square().mean());
    for (double& v : x) v += noise * sd * normal(engine);
    r.add(run.states[k], Quantity::dimensionless, x);
  }
  if (inputs.cols() > 0) {
    Eigen::VectorXd u(s.samples);
    for (Eigen::Index i = 0; i < s.samples; ++i) u[i] = s.input(s.dt * static_cast<double>(i));
    r.add("u", Quantity::dimensionless, u);
  }
  return r;
}

}  // namespace whirl::testing
