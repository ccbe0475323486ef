#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/regression/regression.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

/// 2 w1 - 0.3 w2, the next value of x, with w1 and w2 far from orthogonal.
Recording map_record() {
  Recording r;
  r.dt = 1;
  const Eigen::Index n = 200;
  Eigen::VectorXd w1(n), w2(n), x(n);
  std::mt19937_64 engine(3);
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < n; ++i) {
    w1[i] = normal(engine);
    w2[i] = 0.5 * w1[i] + normal(engine);
  }
  x[0] = 0;
  x.tail(n - 1) = 2 * w1.head(n - 1) - 0.3 * w2.head(n - 1);
  r.add("x", Quantity::dimensionless, x);
  r.add("w1", Quantity::dimensionless, w1);
  r.add("w2", Quantity::dimensionless, w2);
  return r;
}

SindyOptions map_options() {
  SindyOptions o;
  o.states = {"x"};
  o.inputs = {"w1", "w2"};
  o.discrete = true;
  o.library = {"w1", "w2"};
  return o;
}

TEST(SignBoundReference, TheMapOfOneActiveBoundIsItsKarushKuhnTuckerPoint) {
  const Recording r = map_record();
  const Eigen::Index n = r.size() - 1;
  const Eigen::VectorXd w1 = r["w1"].head(n), w2 = r["w2"].head(n), y = r["x"].tail(n);
  SindyOptions o = map_options();
  o.equations.signs = {{"x", "w2", 1}, {"", "w1", 1}};
  std::vector<BoundOutcome> bounds;
  const IdentifiedModel m = fit_sindy({r}, o, &bounds);
  // Stationary in w1 with w2 at its bound: xi1 = w1'y / w1'w1; the multiplier -w2'(y - w1 xi1) is positive.
  const double xi1 = w1.dot(y) / w1.squaredNorm();
  ASSERT_LT(w2.dot(y - w1 * xi1), 0);
  ASSERT_EQ(m.equations.front().terms.size(), 1u);
  EXPECT_NEAR(m.equations.front().terms[0].coefficient.value, xi1, 1e-12);
  ASSERT_EQ(bounds.size(), 2u);
  EXPECT_TRUE(bounds[0].kept);
  EXPECT_FALSE(bounds[0].active);
  EXPECT_EQ(bounds[1].function, "w2");
  EXPECT_FALSE(bounds[1].kept);
  EXPECT_TRUE(bounds[1].active);
  EXPECT_NEAR(bounds[1].unbounded, -0.3, 1e-12);
  EXPECT_LT(bounds[1].t, -100);
  EXPECT_EQ(m.summary.status, Status::warning);
  ASSERT_FALSE(m.summary.warnings.empty());
  EXPECT_NE(m.summary.warnings.back().find("w2 >= 0 is active"), std::string::npos) << m.summary.warnings.back();
  EXPECT_EQ(m.parameter("x[k+1]: w2"), nullptr);
}

TEST(SignBoundReference, BoundsThatDoNotBindChangeNothing) {
  const Recording r = map_record();
  SindyOptions o = map_options();
  const IdentifiedModel free = fit_sindy({r}, o);
  o.equations.signs = {{"x[k+1]", "w2", -1}, {"", "-w1", -1}};  // the function -w1 with a negative factor
  std::vector<BoundOutcome> bounds;
  const IdentifiedModel m = fit_sindy({r}, o, &bounds);
  ASSERT_EQ(m.equations.front().terms.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(m.equations.front().terms[k].coefficient.value, free.equations.front().terms[k].coefficient.value);
    EXPECT_EQ(m.equations.front().terms[k].coefficient.sd, free.equations.front().terms[k].coefficient.sd);
  }
  for (const BoundOutcome& b : bounds) EXPECT_TRUE(b.kept && !b.active) << b.function;
}

TEST(SignBound, WhatNamesNoTermIsRefusedWithTheTermsThereAre) {
  const Recording r = map_record();
  const auto message = [&](std::vector<SignBound> signs) -> std::string {
    SindyOptions o = map_options();
    o.equations.signs = std::move(signs);
    try {
      fit_sindy({r}, o);
    } catch (const Error& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message({{"", "w3", 1}}), "sign bound = w3: must be a term of the library (x[k+1]: w1, w2)");
  EXPECT_EQ(message({{"q", "w1", 1}}), "sign bound = q:w1: must be of an equation that is sought (x[k+1])");
  EXPECT_NE(message({{"", "w1", 2}}).find("1 or -1"), std::string::npos);
  EXPECT_NE(message({{"", "w1", 1}, {"x", "w1", -1}}).find("contradict"), std::string::npos);
}

TEST(SignBoundProperty, BestSubsetIsTheBestOfAllSupportsAndEveryMethodStaysWithinBounds) {
  std::mt19937_64 engine(11);
  std::normal_distribution<double> normal;
  for (int round = 0; round < 20; ++round) {
    const Eigen::Index n = 60, q = 7;
    Eigen::MatrixXd theta(n, q);
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double shared = normal(engine);
      for (Eigen::Index j = 0; j < q; ++j) theta(i, j) = normal(engine) + shared;
      y[i] = theta(i, 0) - 0.8 * theta(i, 2) + 0.5 * theta(i, 5) - 0.4 * theta(i, 6) + 0.5 * normal(engine);
    }
    regression::SolveOptions o{.method = "best_subset"};
    for (Eigen::Index j = 0; j < q; ++j) o.rules.sign.push_back(static_cast<int>(engine() % 3) - 1);
    const regression::Problem problem = regression::make_problem(theta, y, 10);
    const regression::SparseFit fit = regression::solve(problem, o);
    for (int size = 1; size <= q; ++size) {
      double best = INFINITY, found = INFINITY;
      for (int mask = 1; mask < 1 << q; ++mask) {
        std::vector<int> support;
        for (int j = 0; j < q; ++j) {
          if ((mask >> j & 1) != 0) support.push_back(j);
        }
        if (static_cast<int>(support.size()) != size) continue;
        best = std::min(best, problem.total.residual(regression::refit(problem.total, support, o)));
      }
      for (const regression::PathPoint& p : fit.path) {
        if (p.terms <= size) found = std::min(found, p.rss);
      }
      EXPECT_NEAR(found / best, 1, 1e-9) << "round " << round << " size " << size;
    }
    for (const std::string& method : regression::regression_methods()) {
      o.method = method;
      o.ensemble.resamples = 10;
      const regression::SparseFit bounded = regression::solve(problem, o);
      for (std::size_t j = 0; j < o.rules.sign.size(); ++j)
        EXPECT_GE(o.rules.sign[j] * bounded.xi[static_cast<Eigen::Index>(j)], 0) << method;
    }
  }
}

/// Duffing oscillator with a quadratic term: v' = -x + 0.1 x^2 - x^3 - 0.3 v + u.
Recording duffing_record(double noise) {
  testing::ZooSystem s;
  s.truth = testing::zoo_model(
      {{"x", {{1, "v"}}}, {"v", {{-0.3, "v"}, {-1, "x"}, {0.1, "x^2"}, {-1, "x^3"}, {1, "u"}}}}, {"u"});
  s.start = {1, 0};
  s.dt = 0.02;
  s.samples = 4000;
  s.input = [](double t) { return 2 * std::cos(1.2 * t) + std::cos(0.7 * t + 1); };
  return testing::zoo_record(s, noise, 4);
}

/// Coefficient of a term, NaN when the equation has it not.
double coefficient(const IdentifiedModel& model, const std::string& lhs, const std::string& function) {
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (e.lhs == lhs && t.function == function) return t.coefficient.value;
    }
  }
  return NAN;
}

TEST(SignBoundProperty, RefinedModelsStayWithinBoundsAndTellActiveOnes) {
  for (const double noise : {0.0, 0.01}) {
    const Recording r = duffing_record(noise);
    SindyOptions o;
    o.states = {"x", "v"};
    o.inputs = {"u"};
    const IdentifiedModel free = fit_sindy({r}, o);
    EXPECT_NEAR(coefficient(free, "v'", "x^2"), 0.1, 0.02);
    o.equations.signs = {{"v'", "x^2", -1}, {"v'", "v", -1}, {"v", "x^3", -1}};
    std::vector<BoundOutcome> bounds;
    const IdentifiedModel m = fit_sindy({r}, o, &bounds);
    for (const Equation& e : m.equations) {
      for (const EquationTerm& t : e.terms) {
        for (const BoundOutcome& b : bounds) {
          if (b.equation != e.lhs || b.function != t.function) continue;
          EXPECT_GE(b.sign * t.coefficient.value, 0) << t.function;
        }
      }
    }
    ASSERT_EQ(bounds.size(), 3u);
    for (const BoundOutcome& b : bounds) {
      EXPECT_EQ(b.active, b.function == "x^2") << b.function << " noise " << noise;
      EXPECT_EQ(b.kept, b.function != "x^2") << b.function << " noise " << noise;
      if (b.active) {
        EXPECT_GT(b.t, 4);
        EXPECT_GT(b.unbounded, 0);
      }
    }
    EXPECT_TRUE(std::isnan(coefficient(m, "v'", "x^2")));
  }
}

}  // namespace
}  // namespace whirl::identification
