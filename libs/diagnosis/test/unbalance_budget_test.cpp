#include "whirl/diagnosis/unbalance_budget.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/testing/balancing_jobs.hpp"

namespace whirl::diagnosis {
namespace {

// The handbook form U = 9549 G m / n (g mm; kg, r/min), and the much printed 20 um for G 6.3 at 3000 r/min.
TEST(UnbalanceBudget, PermissibleUnbalanceOfTheHandbook) {
  const auto speed = [](double rpm) { return rpm * std::numbers::pi / 30; };
  EXPECT_NEAR(1e6 * permissible_unbalance(6.3, 1, speed(3000)), 20.05, 0.01);
  for (const auto& [g, m, n] : {std::array{2.5, 3600.0, 3000.0}, {6.3, 20.0, 1500.0}, {16.0, 35.0, 4200.0}})
    EXPECT_NEAR(1e6 * permissible_unbalance(g, m, speed(n)), 9549 * g * m / n, 1e-4 * 9549 * g * m / n);
  EXPECT_THROW(permissible_unbalance(6.3, 0, 1), std::exception);
}

TEST(UnbalanceBudget, ErrorsAddByTheRootOfTheSquares) {
  CorrectionUncertainty u;
  u.covariance = Eigen::Matrix2d::Identity() * 1e-8;  // 0.1 g per component
  u.quantile = 2;
  const Eigen::VectorXcd best = Eigen::VectorXcd::Constant(1, 10e-3), on = Eigen::VectorXcd::Constant(1, 10.5e-3);
  const PlaneBudget b = unbalance_budget(0, best, u, on, 0.1, {0.05e-3, 0.02, 1e-3}, 1e-4);
  EXPECT_NEAR(b.residual, 0.5e-4, 1e-12);
  EXPECT_NEAR(b.scatter, 2e-5, 1e-12);
  EXPECT_NEAR(b.mass, 0.5e-5, 1e-12);
  EXPECT_NEAR(b.angle, 2.1e-5, 1e-9);
  EXPECT_NEAR(b.radius, 1.05e-5, 1e-12);
  EXPECT_NEAR(b.error, std::sqrt(4e-10 + 0.25e-10 + 4.41e-10 + 1.1025e-10), 1e-9);
  EXPECT_EQ(b.tolerance, Tolerance::held);
  EXPECT_EQ(unbalance_budget(0, best, u, on, 0.1, {0.05e-3, 0.02, 1e-3}, 6e-5).tolerance, Tolerance::undecided);
  EXPECT_EQ(unbalance_budget(0, best, u, on, 0.1, {0.05e-3, 0.02, 1e-3}, 1e-5).tolerance, Tolerance::not_held);
}

// A verdict is worth what it can refuse: on random jobs with a tolerance near the true residual, "held" and "not held"
// are wrong in less than 5 %.
TEST(UnbalanceBudgetProperty, TheVerdictIsSeldomWrong) {
  int wrong = 0, said = 0;
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (unsigned k = 0; k < 300; ++k) {
    testing::RandomJobOptions o;
    o.noise = 0.02;
    const testing::RandomJob j = testing::random_job(o, 130000 + k);
    const InfluenceFit fit = fit_influence(j.job);
    CorrectionProblem problem, truth;
    problem.influence = fit.influence;
    problem.vibration = fit.baseline;
    truth.influence = j.influence;
    truth.vibration = j.vibration;
    const Eigen::VectorXcd w = solve_correction(problem, Criterion::least_squares).masses,
                           best = solve_correction(truth, Criterion::least_squares).masses;
    const CorrectionUncertainty u = correction_uncertainty(fit, problem, w);
    for (Eigen::Index p = 0; p < w.size(); ++p) {
      Eigen::VectorXcd on = w;
      on[p] += std::polar(3 * std::sqrt(u.covariance(p, p)) * uniform(random), 6.28 * uniform(random));
      const double residual = std::abs(on[p] - best[p]);
      const double permitted = residual * (0.3 + 2 * uniform(random));
      const PlaneBudget b = unbalance_budget(p, w, u, on, 1, {}, permitted);
      if (b.tolerance == Tolerance::undecided) continue;
      ++said;
      wrong += (b.tolerance == Tolerance::held) != (residual <= permitted);
    }
  }
  std::cout << "verdicts " << said << " of 600, wrong " << wrong << "\n";
  EXPECT_GE(said, 60);
  EXPECT_LE(wrong, 0.05 * said);
}

}  // namespace
}  // namespace whirl::diagnosis
