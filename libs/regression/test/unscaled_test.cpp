#include "whirl/regression/unscaled.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::regression {
namespace {

struct Rows {
  Eigen::MatrixXd theta;
  Eigen::VectorXd y, truth;
  GramBlock sums() const { return make_problem(theta, y, 1).total; }
};

/// n rows, q correlated columns of similar size; three coefficients of 1 to 3, the others 0.
Rows random_rows(int n, int q, double noise, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  Rows d{Eigen::MatrixXd(n, q), Eigen::VectorXd(n), Eigen::VectorXd::Zero(q)};
  for (int i = 0; i < n; ++i) {
    const double common = normal(engine);
    for (int j = 0; j < q; ++j) d.theta(i, j) = (1 + 0.2 * j) * (normal(engine) + 0.8 * common);
  }
  for (int j : {0, 2, q - 1}) d.truth[j] = (j == 2 ? -1.0 : 1.0) * (1 + 2.0 * j / q);
  d.y = d.theta * d.truth;
  for (double& v : d.y) v += noise * normal(engine);
  return d;
}

/// |y - Theta xi|^2 + alpha |xi|^2 on some columns, by QR of the rows with sqrt(alpha) I below them.
Eigen::VectorXd ridge_by_rows(const Rows& d, const std::vector<int>& support, double alpha) {
  const auto k = static_cast<Eigen::Index>(support.size());
  Eigen::MatrixXd rows(d.theta.rows() + k, k);
  rows << d.theta(Eigen::all, support), std::sqrt(alpha) * Eigen::MatrixXd::Identity(k, k);
  Eigen::VectorXd target = Eigen::VectorXd::Zero(rows.rows());
  target.head(d.y.size()) = d.y;
  Eigen::VectorXd xi = Eigen::VectorXd::Zero(d.theta.cols());
  xi(support) = Eigen::VectorXd(rows.colPivHouseholderQr().solve(target));
  return xi;
}

std::vector<int> nonzero(const Eigen::VectorXd& xi) {
  std::vector<int> s;
  for (Eigen::Index j = 0; j < xi.size(); ++j)
    if (xi[j] != 0) s.push_back(static_cast<int>(j));
  return s;
}

TEST(UnscaledStlsqProperty, EndsAtTheRidgeSolutionOfTermsAboveTheThreshold) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Rows d = random_rows(200, 8, 0.4, seed);
    const UnscaledPath path = solve_unscaled(d.sums(), {.method = "stlsq", .threshold = 0.3, .ridge = 2.0});
    ASSERT_TRUE(path.converged);
    const Eigen::VectorXd& xi = path.xi.back();
    const std::vector<int> support = nonzero(xi);
    ASSERT_FALSE(support.empty());
    EXPECT_LT((xi - ridge_by_rows(d, support, 2.0)).cwiseAbs().maxCoeff(), 1e-10);
    for (int j : support) EXPECT_GE(std::abs(xi[j]), 0.3);
    EXPECT_NEAR(path.mean_square.back(), (d.y - d.theta * xi).squaredNorm() / 200, 1e-9);
  }
}

TEST(UnscaledStlsqProperty, KeptTermsAreNeitherThresholdedNorUnderTheRidge) {
  const Rows d = random_rows(300, 6, 0.1, 4);
  const UnscaledPath path =
      solve_unscaled(d.sums(), {.method = "stlsq", .threshold = 1e3, .ridge = 5.0, .keep = {1, 3}});
  EXPECT_EQ(nonzero(path.xi.back()), (std::vector<int>{1, 3}));
  EXPECT_LT((path.xi.back() - ridge_by_rows(d, {1, 3}, 0)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(UnscaledStlsqProperty, UnitsMatterAndDependentColumnsShareTheirCoefficient) {
  Rows d = random_rows(300, 6, 0.01, 5);
  const UnscaledOptions options{.method = "stlsq", .threshold = 0.5, .ridge = 0};
  EXPECT_EQ(nonzero(solve_unscaled(d.sums(), options).xi.back()), (std::vector<int>{0, 2, 5}));
  d.theta.col(0) *= 10;  // the coefficient falls to 0.1
  EXPECT_EQ(nonzero(solve_unscaled(d.sums(), options).xi.back()), (std::vector<int>{2, 5}));
  Rows twice = random_rows(300, 6, 0.01, 6);
  twice.theta.col(1) = twice.theta.col(0);
  const Eigen::VectorXd xi = solve_unscaled(twice.sums(), {.method = "stlsq", .threshold = 0, .ridge = 0}).xi.back();
  EXPECT_NEAR(xi[0], xi[1], 1e-6);
  EXPECT_NEAR(xi[0] + xi[1], 1, 0.01);
}

TEST(UnscaledSr3Property, FixedPointsMeetTheConditionsOfTheRelaxedProblem) {
  for (const Penalty penalty : {Penalty::l0, Penalty::l1, Penalty::l2}) {
    const Rows d = random_rows(200, 7, 0.3, 11);
    const double nu = 0.02;
    Eigen::VectorXd weight = Eigen::VectorXd::LinSpaced(7, 2, 8);
    const UnscaledPath path = solve_unscaled(
        d.sums(),
        {.method = "sr3", .max_iterations = 20000, .penalty = penalty, .weight = weight, .nu = nu, .tolerance = 1e-12});
    ASSERT_TRUE(path.converged);
    const Eigen::VectorXd& u = path.xi.back();
    const Eigen::MatrixXd m = d.theta.transpose() * d.theta + Eigen::MatrixXd::Identity(7, 7) / nu;
    const Eigen::VectorXd w = m.ldlt().solve(Eigen::VectorXd(d.theta.transpose() * d.y + u / nu));
    for (Eigen::Index j = 0; j < 7; ++j) {
      const double pull = (w[j] - u[j]) / nu;  // has to be lambda_j times a slope of R at u_j
      if (penalty == Penalty::l2) {
        EXPECT_NEAR(pull, 2 * weight[j] * u[j], 1e-6);
      } else if (penalty == Penalty::l1 && u[j] != 0) {
        EXPECT_NEAR(pull, std::copysign(weight[j], u[j]), 1e-6);
      } else if (penalty == Penalty::l1) {
        EXPECT_LE(std::abs(pull), weight[j] + 1e-6);
      } else if (u[j] != 0) {
        EXPECT_NEAR(pull, 0, 1e-6);
        EXPECT_GE(0.5 * u[j] * u[j] / nu, weight[j] - 1e-9);  // keeping it pays
      } else {
        EXPECT_LE(0.5 * w[j] * w[j] / nu, weight[j] + 1e-9);
      }
    }
  }
}

TEST(UnscaledSsrProperty, EachStepDropsOneTermByItsCriterion) {
  for (const bool by_residual : {false, true}) {
    const Rows d = random_rows(150, 6, 0.5, 21);
    const UnscaledPath path =
        solve_unscaled(d.sums(), {.method = "ssr", .ridge = 0.1, .max_iterations = 100, .by_residual = by_residual});
    ASSERT_EQ(path.xi.size(), 6u);
    for (std::size_t k = 0; k + 1 < path.xi.size(); ++k) {
      const std::vector<int> before = nonzero(path.xi[k]), after = nonzero(path.xi[k + 1]);
      ASSERT_EQ(after.size() + 1, before.size());
      double least = INFINITY;
      int dropped = -1;
      for (int j : before) {
        std::vector<int> without = before;
        without.erase(std::find(without.begin(), without.end(), j));
        const double worth =
            by_residual ? (d.y - d.theta * ridge_by_rows(d, without, 0.1)).squaredNorm() : std::abs(path.xi[k][j]);
        if (worth < least) {
          least = worth;
          dropped = j;
        }
      }
      EXPECT_EQ(std::count(after.begin(), after.end(), dropped), 0);
      EXPECT_LT((path.xi[k] - ridge_by_rows(d, before, 0.1)).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

TEST(UnscaledFrolsProperty, TheFirstTermIsTheMostCorrelatedAndSupportsGrow) {
  const Rows d = random_rows(150, 7, 0.5, 31);
  const UnscaledPath path = solve_unscaled(d.sums(), {.method = "frols", .ridge = 0, .max_iterations = 4});
  ASSERT_EQ(path.xi.size(), 4u);
  Eigen::Index best = 0;
  const Eigen::VectorXd correlation =
      (d.theta.transpose() * d.y).cwiseAbs().cwiseQuotient(Eigen::VectorXd(d.theta.colwise().norm().transpose()));
  correlation.maxCoeff(&best);
  EXPECT_EQ(nonzero(path.xi[0]), (std::vector<int>{static_cast<int>(best)}));
  for (std::size_t k = 0; k + 1 < path.xi.size(); ++k) {
    const std::vector<int> small = nonzero(path.xi[k]), large = nonzero(path.xi[k + 1]);
    EXPECT_TRUE(std::includes(large.begin(), large.end(), small.begin(), small.end()));
    EXPECT_LT(path.mean_square[k + 1], path.mean_square[k]);
  }
}

TEST(Unscaled, BadInputIsNamed) {
  const GramBlock sums = random_rows(50, 4, 0.1, 1).sums();
  EXPECT_THROW(solve_unscaled(sums, {.method = "lasso"}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.threshold = -1}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.ridge = std::nan("")}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.max_iterations = 0}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.keep = {4}}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.start = Eigen::VectorXd::Zero(3)}), Error);
  EXPECT_THROW(solve_unscaled(sums, {.method = "sr3"}), Error);  // weights are needed
  EXPECT_FALSE(solve_unscaled(sums, {.threshold = 10, .max_iterations = 1}).converged);
}

}  // namespace
}  // namespace whirl::regression
