#include "whirl/core/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <functional>

namespace whirl {
namespace {

/// Residuals of any kind, Jacobian by central differences.
struct Residuals {
  std::function<Eigen::VectorXd(const Eigen::VectorXd&)> of;
  double enough = 1e-20;  ///< share of the cost
  int linearised = 0;

  void linearise(const Eigen::VectorXd& p, SquareSum& sum) {
    ++linearised;
    const Eigen::VectorXd r = of(p);
    Eigen::MatrixXd j(r.size(), p.size());
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const double h = 1e-6 * std::max(1e-3, std::abs(p[k]));
      j.col(k) =
          (of(p - h * Eigen::VectorXd::Unit(p.size(), k)) - of(p + h * Eigen::VectorXd::Unit(p.size(), k))) / (2 * h);
    }
    sum = {r.squaredNorm(), j.transpose() * j, j.transpose() * r};
  }
  void last(const Eigen::VectorXd& p, SquareSum& sum) { linearise(p, sum); }
  Eigen::VectorXd moved(const Eigen::VectorXd& p, const Eigen::VectorXd& step) const { return p + step; }
  bool small(const SquareSum& sum, const Eigen::VectorXd&, double decrease) const {
    return decrease <= enough * sum.cost;
  }
};

struct Minimum {
  Eigen::VectorXd p;
  SquareSum sum;
  DescentReport report;
};
Minimum minimise(Residuals& problem, Eigen::VectorXd p, int iterations = 200) {
  Minimum m{std::move(p), {}, {}};
  problem.linearise(m.p, m.sum);
  m.report = descend(problem, m.p, m.sum, iterations);
  return m;
}

// NIST StRD Misra1a (Misra 1978): y = b1 (1 - exp(-b2 x)); certified values and standard deviations, from both starts.
TEST(LeastSquaresReference, FindsTheCertifiedValuesOfMisra1a) {
  Eigen::VectorXd y(14), x(14);
  y << 10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78;
  x << 77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0;
  for (const Eigen::Vector2d& start : {Eigen::Vector2d(500, 1e-4), Eigen::Vector2d(250, 5e-4)}) {
    Residuals problem{
        [&](const Eigen::VectorXd& b) { return Eigen::VectorXd(y.array() - b[0] * (1 - (-b[1] * x.array()).exp())); }};
    const Minimum m = minimise(problem, start);
    EXPECT_NE(m.report.end, Descent::exhausted);
    EXPECT_NEAR(m.p[0], 2.3894212918e2, 1e-4);
    EXPECT_NEAR(m.p[1], 5.5015643181e-4, 1e-10);
    EXPECT_NEAR(m.sum.cost, 1.2455138894e-1, 1e-9);
    const InverseInformation inverse = invert_information(m.sum.normal);
    EXPECT_NEAR(std::sqrt(inverse.covariance(0, 0) * m.sum.cost / 12), 2.7070075241, 1e-4);
    EXPECT_NEAR(std::sqrt(inverse.covariance(1, 1) * m.sum.cost / 12), 7.2668688436e-6, 1e-9);
  }
}

TEST(LeastSquares, FollowsACurvedValleyWhereGaussNewtonStepsFail) {
  Residuals problem{
      [](const Eigen::VectorXd& p) { return Eigen::VectorXd(Eigen::Vector2d(10 * (p[1] - p[0] * p[0]), 1 - p[0])); }};
  const Minimum m = minimise(problem, Eigen::Vector2d(-1.2, 1));
  EXPECT_NEAR(m.p[0], 1, 1e-6);
  EXPECT_NEAR(m.p[1], 1, 1e-6);
  EXPECT_LT(m.report.iterations, 60);
}

TEST(LeastSquares, RaisesTheDampingWhereAFullStepOvershoots) {
  // From 10 the Gauss-Newton step of atan leaves for ever larger values.
  Residuals problem{[](const Eigen::VectorXd& p) { return Eigen::VectorXd(-p.array().atan()); }};
  const Minimum m = minimise(problem, Eigen::VectorXd::Constant(1, 10));
  EXPECT_NEAR(m.p[0], 0, 1e-6);
}

TEST(LeastSquares, LeavesAParameterWithoutEffectWhereItIs) {
  Residuals problem{[](const Eigen::VectorXd& p) { return Eigen::VectorXd(Eigen::Vector2d(p[0] - 3, 2 * p[0] - 6)); }};
  const Minimum m = minimise(problem, Eigen::Vector2d(0, 7));
  EXPECT_NEAR(m.p[0], 3, 1e-9);
  EXPECT_EQ(m.p[1], 7);
  EXPECT_EQ(invert_information(m.sum.normal).covariance.size(), 0);
}

TEST(LeastSquares, TurnsBackWhereTheResidualIsNotFinite) {
  Residuals problem{
      [](const Eigen::VectorXd& p) { return Eigen::VectorXd(Eigen::VectorXd::Constant(1, std::log(p[0]))); }};
  const Minimum m = minimise(problem, Eigen::VectorXd::Constant(1, 20));  // the first step goes below zero
  EXPECT_NEAR(m.p[0], 1, 1e-6);
}

TEST(LeastSquares, DoesNothingFromAStartWithoutResidual) {
  Residuals problem{[](const Eigen::VectorXd& p) { return Eigen::VectorXd((p.array() - 1).sqrt()); }};
  const Minimum m = minimise(problem, Eigen::VectorXd::Constant(1, 0));
  EXPECT_EQ(m.p[0], 0);
  EXPECT_EQ(m.report.iterations, 0);
}

TEST(LeastSquares, TellsThatItRanOutOfSteps) {
  Residuals problem{
      [](const Eigen::VectorXd& p) { return Eigen::VectorXd(Eigen::Vector2d(10 * (p[1] - p[0] * p[0]), 1 - p[0])); }};
  const Minimum m = minimise(problem, Eigen::Vector2d(-1.2, 1), 3);
  EXPECT_EQ(m.report.end, Descent::exhausted);
  EXPECT_EQ(m.report.iterations, 3);
}

TEST(LeastSquares, InvertsANearlySingularMatrixOnlyWhenAskedTo) {
  Eigen::Matrix2d n;
  n << 1, 1, 1, 1;
  EXPECT_EQ(invert_information(n).covariance.size(), 0);
  const InverseInformation forced = invert_information(n, 1e-13);
  ASSERT_EQ(forced.covariance.size(), 4);
  // The sum is known: variance 1 / 4 of half the sum of both.
  EXPECT_NEAR(forced.covariance.sum(), 1, 0.1);
}

/// 400 runs with two starts each, three coefficients that all of them see: an arrow.
TEST(LeastSquaresProperty, RunsWithStartsOfTheirOwnGiveTheStepOfTheFullEquations) {
  constexpr Eigen::Index kShared = 3, kRuns = 400, n = kShared + 2 * kRuns;
  std::srand(5);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index r = 0; r < kRuns; ++r) {
    const Eigen::MatrixXd rows = Eigen::MatrixXd::Random(9, kShared + 2), own = rows.transpose() * rows;
    const Eigen::Index at = kShared + 2 * r;
    normal.topLeftCorner(kShared, kShared) += own.topLeftCorner(kShared, kShared);
    normal.block(0, at, kShared, 2) = own.topRightCorner(kShared, 2);
    normal.block(at, 0, 2, kShared) = own.bottomLeftCorner(2, kShared);
    normal.block(at, at, 2, 2) = own.bottomRightCorner(2, 2);
  }
  const Eigen::VectorXd gradient = Eigen::VectorXd::Random(n);
  Eigen::VectorXd step;
  ASSERT_TRUE(damped_step(normal, gradient, 0, step));
  EXPECT_LT((normal * step - gradient).norm(), 1e-10 * gradient.norm());
  const Eigen::MatrixXd full = normal.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd corner = full.topLeftCorner(kShared, kShared).inverse();
  EXPECT_LT((marginal_information(normal, kShared) - corner).norm(), 1e-9 * corner.norm());
}

TEST(LeastSquaresProperty, MarginalInformationIsTheInverseOfTheCornerOfTheInverse) {
  const Eigen::MatrixXd j = Eigen::MatrixXd::Random(40, 6);
  const Eigen::MatrixXd n = j.transpose() * j;
  const Eigen::MatrixXd corner = invert_information(n).covariance.topLeftCorner(2, 2);
  EXPECT_LT((marginal_information(n, 2) - corner.inverse()).norm(), 1e-9 * n.norm());
  EXPECT_EQ(marginal_information(n, 6), n);
}

}  // namespace
}  // namespace whirl
