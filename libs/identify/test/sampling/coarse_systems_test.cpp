// General systems sampled ten to thirty times a cycle: one step of the integration a sample would leave errors that the
// search takes for terms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {
namespace {

using State = std::vector<double>;
using Rate = std::function<State(const State&)>;

/// One sample by 64 steps of Heun's rule of order 2, extrapolated once (order 4 in steps a sixty-fourth as long).
State sample_later(const Rate& f, const State& start, double dt) {
  const auto heun = [&](int steps) {
    const double h = dt / steps;
    State x = start;
    for (int k = 0; k < steps; ++k) {
      const State a = f(x);
      State y = x;
      for (std::size_t j = 0; j < x.size(); ++j) y[j] += h * a[j];
      const State b = f(y);
      for (std::size_t j = 0; j < x.size(); ++j) x[j] += 0.5 * h * (a[j] + b[j]);
    }
    return x;
  };
  const State coarse = heun(64), fine = heun(128);
  State x = fine;
  for (std::size_t j = 0; j < x.size(); ++j) x[j] += (fine[j] - coarse[j]) / 3;
  return x;
}

struct System {
  std::vector<std::string> names;
  Rate rate;
  State start;
  double seconds, hertz;
  std::vector<std::vector<std::string>> terms;  ///< of each equation
};

Recording record_of(const System& s, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto n = static_cast<Eigen::Index>(s.seconds * s.hertz);
  Eigen::MatrixXd x(n, static_cast<Eigen::Index>(s.names.size()));
  State at = s.start;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < at.size(); ++j) x(i, static_cast<Eigen::Index>(j)) = at[j];
    at = sample_later(s.rate, at, 1 / s.hertz);
  }
  Recording r;
  r.dt = 1 / s.hertz;
  r.source = "coarse";
  for (std::size_t j = 0; j < s.names.size(); ++j) {
    Eigen::VectorXd v = x.col(static_cast<Eigen::Index>(j));
    const double sd = noise * std::sqrt((v.array() - v.mean()).square().mean());
    for (Eigen::Index i = 0; i < n; ++i) v[i] += sd * normal(random);
    r.add(s.names[j], Quantity::dimensionless, v);
  }
  return r;
}

std::vector<System> systems() {
  return {{{"x", "v"},
           [](const State& s) {
             return State{s[1], -400 * s[0] - 1.2 * s[1] - 8000 * s[0] * s[0] * s[0]};
           },
           {0.3, 0},
           8,
           40,
           {{"v"}, {"x", "v", "x^3"}}},
          {{"x", "y", "z"},
           [](const State& s) {
             return State{10 * (s[1] - s[0]), s[0] * (28 - s[2]) - s[1], s[0] * s[1] - 8.0 / 3 * s[2]};
           },
           {-8, 7, 27},
           20,
           50,
           {{"x", "y"}, {"x", "y", "x*z"}, {"x*y", "z"}}},
          {{"x", "v"},
           [](const State& s) {
             return State{s[1], 4 * (1 - s[0] * s[0]) * s[1] - s[0]};
           },
           {2, 0},
           40,
           20,
           {{"v"}, {"x", "v", "v*x^2"}}}};
}

TEST(CoarseSystemsProperty, TheTermsAreThoseOfTheSystem) {
  for (const System& s : systems()) {
    for (const double noise : {0.0, 0.003, 0.01}) {
      for (std::uint64_t seed = 61; seed < (noise > 0 ? 63u : 62u); ++seed) {
        SindyOptions options;
        options.states = s.names;
        const IdentifiedModel m = fit_sindy({record_of(s, noise, seed)}, options);
        SCOPED_TRACE(::testing::Message() << s.names.size() << " states, noise " << noise << ", seed " << seed);
        ASSERT_EQ(m.equations.size(), s.terms.size());
        for (std::size_t e = 0; e < s.terms.size(); ++e) {
          std::vector<std::string> found, sought;
          for (const EquationTerm& t : m.equations[e].terms) found.push_back(expr::Expr::parse(t.function).str());
          for (const std::string& t : s.terms[e]) sought.push_back(expr::Expr::parse(t).str());
          EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(sought)) << m.equations[e].lhs;
        }
      }
    }
  }
}

TEST(CoarseSystemsConvergence, AFreeRunAtTenSamplesACycleIsThatOfFineSteps) {
  const System s = systems().front();
  IdentifiedModel model;
  model.states = s.names;
  const auto term = [](const char* function, double value) {
    return EquationTerm{function, Estimate::from_sd(value, 0), ""};
  };
  model.equations = {{"x'", {term("v", 1)}}, {"v'", {term("x", -400), term("v", -1.2), term("x^3", -8000)}}};
  const Recording truth = record_of(s, 0, 1);
  const Eigen::VectorXd start = Eigen::Vector2d(s.start[0], s.start[1]);
  const CompiledModel compiled(model);
  const auto error = [&](int substeps) {
    const ModelRun run = simulate(compiled, Eigen::MatrixXd(), start, truth.dt, truth.size(), 1e9, substeps);
    return (run.state("x") - truth["x"]).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(error(1), 0.05);  // of 0.3: the phase is lost
  EXPECT_LT(error(0), 1e-4);
  EXPECT_NEAR(std::log2(error(4) / error(8)), 4.5, 0.7);  // order 4 in the phase, 5 in the damping
}

}  // namespace
}  // namespace whirl::identification
