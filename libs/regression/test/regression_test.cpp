#include "whirl/regression/regression.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::regression {
namespace {

struct Data {
  Eigen::MatrixXd theta;
  Eigen::VectorXd y, truth;
};

/// n rows, q correlated columns of very different size, three of them in the truth.
Data sample_data(int n, int q, double noise, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  Data d{Eigen::MatrixXd(n, q), Eigen::VectorXd(n), Eigen::VectorXd::Zero(q)};
  for (int i = 0; i < n; ++i) {
    const double common = normal(engine);
    for (int j = 0; j < q; ++j) d.theta(i, j) = normal(engine) + 0.7 * common;
  }
  for (int j = 0; j < q; ++j) d.theta.col(j) *= std::pow(10.0, (j * 5) % 9 - 4);
  for (int j : {1, 4, 6}) d.truth[j] = (j == 4 ? -1.0 : 1.0) * (1 + 0.3 * j) / std::pow(10.0, (j * 5) % 9 - 4);
  d.y = d.theta * d.truth;
  for (double& v : d.y) v += noise * normal(engine);
  return d;
}

/// Scaled gradient of 1/(2n)|y - Theta xi|^2 per column of rms 1 and target of rms 1, and the scaled coefficients.
void scaled_gradient(const Data& d, const Eigen::VectorXd& xi, Eigen::VectorXd& gradient, Eigen::VectorXd& w) {
  const double n = static_cast<double>(d.y.size());
  const double y_rms = d.y.norm() / std::sqrt(n);
  const Eigen::VectorXd rms = d.theta.colwise().norm().transpose() / std::sqrt(n);
  gradient = (d.theta.transpose() * (d.y - d.theta * xi)).cwiseQuotient(rms) / (n * y_rms);
  w = xi.cwiseProduct(rms) / y_rms;
}

TEST(RegressionReference, LeastSquaresAgreesWithQr) {
  const Data d = sample_data(300, 9, 0.5, 1);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "ols"});
  const Eigen::VectorXd qr = d.theta.colPivHouseholderQr().solve(d.y);
  EXPECT_LT(((fit.xi - qr).array() / qr.array()).abs().maxCoeff(), 1e-9);
  EXPECT_NEAR(fit.residual_variance, (d.y - d.theta * qr).squaredNorm() / (300 - 9), 1e-10);
  // Standard deviations: diagonal of s^2 (Theta' Theta)^-1.
  const Eigen::VectorXd rms = d.theta.colwise().norm().transpose();
  const Eigen::MatrixXd scaled = d.theta * rms.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd inverse = (scaled.transpose() * scaled).inverse();
  const double sd1 = std::sqrt(fit.residual_variance * inverse(1, 1)) / rms[1];
  EXPECT_NEAR(fit.sd[1] / sd1, 1, 1e-6);
}

TEST(RegressionProperty, EveryMethodFindsAClearSupport) {
  const Data d = sample_data(2000, 9, 0.05, 2);
  const Problem p = make_problem(d.theta, d.y);
  for (const std::string& m : regression_methods()) {
    SolveOptions o{.method = m, .threshold = 0.05, .ridge = m == "ridge" ? 1e-9 : 0.0};
    if (m == "lasso" || m == "lasso_cd") o.lasso.lambda = 0.02;
    const SparseFit fit = solve(p, o);
    if (m == "ols" || m == "ridge") {
      EXPECT_EQ(fit.support.size(), 9u) << m;
    } else {
      EXPECT_EQ(fit.support, (std::vector<int>{1, 4, 6})) << m;
    }
    const double tolerance = m.find("lasso") != std::string::npos ? 0.1 : 0.01;
    for (int j : {1, 4, 6}) EXPECT_NEAR(fit.xi[j] / d.truth[j], 1, tolerance) << m << " term " << j;
    EXPECT_EQ(fit.summary.status, Status::ok) << m;
  }
}

TEST(RegressionProperty, UnitsOfColumnsAndTargetDoNotMatter) {
  const Data d = sample_data(800, 9, 0.8, 3);
  Data other = d;
  Eigen::VectorXd factor(9);
  for (int j = 0; j < 9; ++j) factor[j] = std::pow(10.0, 3 - j);
  other.theta = d.theta * factor.asDiagonal();
  other.y = 1e5 * d.y;
  for (const std::string& m : regression_methods()) {
    const SolveOptions o{.method = m, .ridge = 0.01};
    const SparseFit a = solve(make_problem(d.theta, d.y), o), b = solve(make_problem(other.theta, other.y), o);
    EXPECT_EQ(a.support, b.support) << m;
    const Eigen::VectorXd back = b.xi.cwiseProduct(factor) / 1e5;
    for (int j : a.support) EXPECT_NEAR(back[j] / a.xi[j], 1, 1e-5) << m;
  }
}

TEST(LassoProperty, KarushKuhnTuckerConditionsHoldAlongTheExactPath) {
  const Data d = sample_data(400, 9, 2.0, 4);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "lasso", .selection = Selection::bic});
  Eigen::VectorXd g, w, g0, w0;
  scaled_gradient(d, Eigen::VectorXd::Zero(9), g0, w0);
  const double alpha_max = g0.cwiseAbs().maxCoeff();
  ASSERT_GT(fit.path.size(), 50u);
  for (const PathPoint& p : fit.path) {
    const double alpha = p.parameter * alpha_max;
    scaled_gradient(d, p.xi, g, w);
    for (int j = 0; j < 9; ++j) {
      if (w[j] != 0) {
        EXPECT_NEAR(g[j], std::copysign(alpha, w[j]), 1e-10);
      } else {
        EXPECT_LE(std::abs(g[j]), alpha + 1e-10);
      }
    }
  }
}

TEST(LassoProperty, HomotopyAndCoordinateDescentAgree) {
  const Data d = sample_data(400, 9, 2.0, 5);
  const Problem p = make_problem(d.theta, d.y);
  for (double lambda : {0.5, 0.1, 0.01, 0.0}) {
    const SparseFit a = solve(p, {.method = "lasso", .lasso = {.lambda = lambda}});
    const SparseFit b = solve(p, {.method = "lasso_cd", .lasso = {.lambda = lambda}});
    EXPECT_EQ(a.support, b.support) << lambda;
    for (int j : a.support) EXPECT_NEAR(a.xi[j] / b.xi[j], 1, 1e-6) << lambda;
  }
}

TEST(LassoReference, OrthonormalColumnsAreSoftThresholded) {
  // Tibshirani 1996, section 2.2.
  const int n = 64;
  Eigen::MatrixXd theta(n, 4);
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < 4; ++k) theta(i, k) = std::sqrt(2.0) * std::cos(2 * M_PI * (k + 1) * i / n);
  }
  const Eigen::VectorXd b = (Eigen::VectorXd(4) << 1.0, -0.5, 0.2, 0.0).finished();
  const Eigen::VectorXd y = theta * b;
  const SparseFit fit = solve(make_problem(theta, y), {.method = "lasso", .lasso = {.lambda = 0.3}});
  EXPECT_NEAR(fit.xi[0], 0.7, 1e-12);
  EXPECT_NEAR(fit.xi[1], -0.2, 1e-12);
  EXPECT_EQ(fit.xi[2], 0);
  EXPECT_EQ(fit.xi[3], 0);
}

TEST(LassoProperty, KeptTermsCarryNoPenaltyAndBoundedTermsKeepTheirSign) {
  const Data d = sample_data(400, 9, 2.0, 6);
  SolveOptions o{.method = "lasso", .lasso = {.lambda = 0.3}};
  o.rules.keep = {0};
  o.rules.sign = {0, 0, 0, 0, 1, 0, 0, 0, 0};
  const SparseFit fit = solve(make_problem(d.theta, d.y), o);
  Eigen::VectorXd g, w;
  scaled_gradient(d, fit.xi, g, w);
  EXPECT_NEAR(g[0], 0, 1e-12);
  EXPECT_NE(fit.xi[0], 0);
  EXPECT_GE(fit.xi[4], 0);  // the truth is negative
}

TEST(SquareRootLassoProperty, OptimalityOfTheUnsquaredObjective) {
  const Data d = sample_data(400, 9, 2.0, 7);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "sqrt_lasso"});
  Eigen::VectorXd g, w;
  scaled_gradient(d, fit.xi, g, w);
  const double sigma = (d.y - d.theta * fit.xi).norm() / d.y.norm();
  const double lambda = 1.1 * 2.7729 / std::sqrt(400.0);  // Phi^-1(1 - 0.05/18) = 2.7729
  ASSERT_FALSE(fit.support.empty());
  for (int j = 0; j < 9; ++j) {
    if (w[j] != 0) {
      EXPECT_NEAR(g[j] / sigma, std::copysign(lambda, w[j]), 1e-4 * lambda);
    } else {
      EXPECT_LE(std::abs(g[j]) / sigma, lambda * (1 + 1e-6));
    }
  }
}

TEST(BestSubsetReference, AgreesWithEnumerationOfAllSupports) {
  for (std::uint64_t seed : {8u, 9u, 10u}) {
    Data d = sample_data(60, 9, 6.0, seed);
    d.theta.col(7) = d.theta.col(1) * 1e-3 + d.theta.col(2) * 1e-2;  // nearly dependent columns
    d.theta.col(7) += 1e-3 * d.theta.col(7).norm() * Eigen::VectorXd::Random(60) / 8;
    const Problem p = make_problem(d.theta, d.y);
    const SparseFit fit = solve(p, {.method = "best_subset"});
    std::vector<double> best(10, d.y.squaredNorm());
    for (int mask = 1; mask < 512; ++mask) {
      std::vector<int> support;
      for (int j = 0; j < 9; ++j) {
        if ((mask >> j) & 1) support.push_back(j);
      }
      best[support.size()] = std::min(best[support.size()], p.total.residual(refit(p.total, support)));
    }
    ASSERT_EQ(fit.path.size(), 10u);
    for (const PathPoint& point : fit.path) {
      EXPECT_NEAR(point.rss / best[static_cast<std::size_t>(point.terms)], 1, 1e-7) << point.terms << " terms";
    }
  }
}

// With a largest size, sizes that cannot win are left out, and only those.
TEST(BestSubsetProperty, WinnersAloneAreTheWinnersOfTheWholeSearch) {
  for (std::uint64_t seed = 40; seed < 52; ++seed) {
    const double noise = seed % 3 == 0 ? 0.1 : seed % 3 == 1 ? 2 : 20;
    const Data d = sample_data(120, 14, noise, seed);
    const Problem p = make_problem(d.theta, d.y);
    const SparseFit whole = solve(p, {.method = "best_subset"});
    const SparseFit winners = solve(p, {.method = "best_subset", .max_terms = 12});
    EXPECT_EQ(winners.support, whole.support) << seed;
    for (const PathPoint& point : winners.path) {
      const auto same = std::find_if(whole.path.begin(), whole.path.end(),
                                     [&](const PathPoint& o) { return o.terms == point.terms; });
      ASSERT_NE(same, whole.path.end());
      EXPECT_GE(point.rss, same->rss * (1 - 1e-9));
      if (point.terms <= static_cast<int>(whole.support.size())) {
        EXPECT_NEAR(point.rss / same->rss, 1, 1e-9) << seed << " " << point.terms;
      }
    }
  }
}

TEST(SubsetProperty, ForwardPathReducesTheResidualAndStepwiseEndsWithOneTerm) {
  const Data d = sample_data(300, 9, 3.0, 11);
  const Problem p = make_problem(d.theta, d.y);
  const SparseFit forward = solve(p, {.method = "frols"});
  for (std::size_t k = 1; k < forward.path.size(); ++k) {
    EXPECT_LE(forward.path[k].rss, forward.path[k - 1].rss * (1 + 1e-12));
    EXPECT_EQ(forward.path[k].terms, static_cast<int>(k));
  }
  // First term of forward orthogonal least squares: the largest squared correlation.
  Eigen::VectorXd g, w;
  scaled_gradient(d, Eigen::VectorXd::Zero(9), g, w);
  Eigen::Index largest = 0;
  g.cwiseAbs().maxCoeff(&largest);
  EXPECT_NE(forward.path[1].xi[largest], 0);
  const SparseFit stepwise = solve(p, {.method = "ssr"});
  EXPECT_EQ(stepwise.path.size(), 10u);
  EXPECT_EQ(stepwise.path[8].terms, 1);
}

TEST(StlsqProperty, EveryKeptTermHasAtLeastTheThresholdShare) {
  const Data d = sample_data(300, 9, 3.0, 12);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "stlsq", .threshold = 0.1});
  Eigen::VectorXd g, w;
  scaled_gradient(d, fit.xi, g, w);
  for (int j : fit.support) EXPECT_GE(std::abs(w[j]), 0.1);
  // Kept by rule although it is below.
  SolveOptions o{.method = "stlsq", .threshold = 0.1};
  o.rules.keep = {0};
  const SparseFit kept = solve(make_problem(d.theta, d.y), o);
  EXPECT_TRUE(std::count(kept.support.begin(), kept.support.end(), 0));
}

TEST(BoundedLeastSquaresProperty, KarushKuhnTuckerConditionsHold) {
  const Data d = sample_data(80, 9, 8.0, 13);
  SolveOptions o{.method = "ols"};
  o.rules.sign = {1, 1, 1, 1, 1, 1, 1, 1, 1};
  const SparseFit fit = solve(make_problem(d.theta, d.y), o);
  Eigen::VectorXd g, w;
  scaled_gradient(d, fit.xi, g, w);
  ASSERT_LT(fit.support.size(), 9u);
  for (int j = 0; j < 9; ++j) {
    EXPECT_GE(w[j], 0);
    if (w[j] > 0) {
      EXPECT_NEAR(g[j], 0, 1e-10);
    } else {
      EXPECT_LE(g[j], 1e-10);
    }
  }
}

TEST(EliminationProperty, TiedAndFixedCoefficientsSolveTheConstrainedProblem) {
  const Data d = sample_data(200, 9, 1.0, 14);
  // xi1 = -2 xi4, xi0 + xi2 = 3, xi8 = 0.5
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3, 9);
  a(0, 1) = 1, a(0, 4) = 2, a(1, 0) = 1, a(1, 2) = 1, a(2, 8) = 1;
  const Eigen::VectorXd b = (Eigen::VectorXd(3) << 0, 3, 0.5).finished();
  const Elimination e = eliminate(a, b);
  ASSERT_EQ(e.free.size(), 6u);
  const SparseFit fit = solve(reduce(make_problem(d.theta, d.y), e), {.method = "ols"});
  const Eigen::VectorXd xi = e.fixed + e.map * fit.xi;
  EXPECT_LT((a * xi - b).cwiseAbs().maxCoeff(), 1e-9);
  // Against the Lagrange system.
  Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(12, 12);
  const Eigen::VectorXd scale = d.theta.colwise().norm().cwiseInverse();
  const Eigen::MatrixXd scaled = d.theta * scale.asDiagonal();
  kkt.topLeftCorner(9, 9) = scaled.transpose() * scaled;
  Eigen::MatrixXd as = a * scale.asDiagonal();
  Eigen::VectorXd rhs(12);
  rhs.head(9) = scaled.transpose() * d.y;
  for (int i = 0; i < 3; ++i) {
    const double size = as.row(i).norm();
    rhs[9 + i] = b[i] / size;
    as.row(i) /= size;
  }
  kkt.topRightCorner(9, 3) = as.transpose();
  kkt.bottomLeftCorner(3, 9) = as;
  const Eigen::VectorXd direct = scale.cwiseProduct(kkt.fullPivLu().solve(rhs).head(9));
  for (int j = 0; j < 9; ++j) EXPECT_NEAR(xi[j] / direct[j], 1, 1e-6) << j;
  EXPECT_THROW(eliminate((Eigen::MatrixXd(2, 2) << 1, 1, 2, 2).finished(), (Eigen::VectorXd(2) << 1, 3).finished()),
               Error);
}

TEST(EnsembleProperty, InclusionSeparatesTrueFromFalseTerms) {
  const Data d = sample_data(2000, 9, 1.0, 15);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "ensemble", .threshold = 0.05});
  for (int j = 0; j < 9; ++j) {
    if (d.truth[j] != 0) {
      EXPECT_GE(fit.inclusion[j], 0.99) << j;
    } else {
      EXPECT_LE(fit.inclusion[j], 0.5) << j;
    }
  }
  const SparseFit again = solve(make_problem(d.theta, d.y), {.method = "ensemble", .threshold = 0.05});
  EXPECT_EQ(fit.xi, again.xi);  // seeded
}

TEST(EnsembleProperty, LibraryBaggingCountsOnlyOfferedTerms) {
  const Data d = sample_data(2000, 9, 1.0, 20);
  const SparseFit fit =
      solve(make_problem(d.theta, d.y),
            {.method = "ensemble", .threshold = 0.05, .ensemble = {.resamples = 300, .drop_terms = 2}});
  for (int j : {1, 4, 6}) EXPECT_GE(fit.inclusion[j], 0.95) << j;
  EXPECT_LE(fit.inclusion.maxCoeff(), 1.0);
}

TEST(SubsetProperty, ModelSizeLimitHolds) {
  const Data d = sample_data(500, 9, 0.5, 21);
  const Problem p = make_problem(d.theta, d.y);
  for (const char* method : {"frols", "best_subset"}) {
    const SparseFit fit = solve(p, {.method = method, .max_terms = 2});
    EXPECT_EQ(fit.support.size(), 2u) << method;
    EXPECT_EQ(fit.path.back().terms, 2) << method;
  }
}

TEST(SelectionProperty, AicKeepsAtLeastTheTermsOfBicAndTheNoiseFloorStopsBoth) {
  const Data d = sample_data(2000, 9, 0.02, 22);
  Data biased = d;
  biased.y += 0.003 * d.y.norm() / d.theta.col(0).norm() * d.theta.col(0);  // a small systematic error of the rows
  const Problem p = make_problem(biased.theta, biased.y);
  const SparseFit bic = solve(p, {.method = "best_subset"});
  const SparseFit aic = solve(p, {.method = "best_subset", .selection = Selection::aic});
  EXPECT_GE(aic.support.size(), bic.support.size());
  EXPECT_NE(bic.xi[0], 0);
  const SparseFit floored = solve(p, {.method = "best_subset", .noise_floor = 0.1});
  EXPECT_EQ(floored.support, (std::vector<int>{1, 4, 6}));
}

TEST(CrossValidationProperty, OneStandardErrorRuleIsNoLargerThanTheMinimum) {
  const Data d = sample_data(1000, 9, 3.0, 16);
  const Problem p = make_problem(d.theta, d.y);
  for (const char* method : {"lasso", "lspl", "ssr", "frols", "best_subset"}) {
    const SparseFit a = solve(p, {.method = method, .selection = Selection::cv});
    const SparseFit b = solve(p, {.method = method, .selection = Selection::cv_1se});
    EXPECT_LE(b.support.size(), a.support.size()) << method;
    for (int j : {1, 4, 6}) EXPECT_NE(b.xi[j], 0) << method;
    ASSERT_FALSE(a.path.empty());
    EXPECT_NEAR(a.path[a.path.size() / 2].cv_mean / 9.0, 1, 0.4) << method;  // near the noise variance
  }
}

TEST(GramAccumulatorProperty, StreamedRowsGiveTheSameSumsAndSkipRowsThatAreNotFinite) {
  Data d = sample_data(1001, 9, 1.0, 17);
  d.y[500] = std::numeric_limits<double>::quiet_NaN();
  GramAccumulator sums(9, 1, 100);
  for (int at = 0; at < 1001; at += 77) {
    const int n = std::min(77, 1001 - at);
    sums.add(d.theta.middleRows(at, n), d.y.segment(at, n));
  }
  EXPECT_EQ(sums.rows(), 1000);
  const Problem p = sums.problem(0);
  Eigen::MatrixXd theta(1000, 9);
  theta << d.theta.topRows(500), d.theta.bottomRows(500);
  const Eigen::MatrixXd gram = theta.transpose() * theta;
  EXPECT_LT(((p.total.gram - gram).array() / gram.array()).abs().maxCoeff(), 1e-11);
  GramBlock total = p.blocks[0];
  for (std::size_t b = 1; b < p.blocks.size(); ++b) total += p.blocks[b];
  EXPECT_EQ(total.gram, p.total.gram);
  EXPECT_EQ(p.blocks.size(), 10u);
}

TEST(Regression, BadInputIsToldByName) {
  const Data d = sample_data(50, 9, 1.0, 18);
  const Problem p = make_problem(d.theta, d.y);
  EXPECT_THROW(solve(p, {.method = "magic"}), Error);
  EXPECT_THROW(solve(p, {.threshold = 2}), Error);
  SolveOptions o;
  o.rules.sign = {1, 0};
  EXPECT_THROW(solve(p, o), Error);
  Problem no_blocks = p;
  no_blocks.blocks.clear();
  EXPECT_THROW(solve(no_blocks, {.method = "lasso"}), Error);
}

TEST(Regression, DependentColumnsAreReported) {
  Data d = sample_data(50, 9, 1.0, 19);
  d.theta.col(2) = 3 * d.theta.col(1);
  const SparseFit fit = solve(make_problem(d.theta, d.y), {.method = "ols"});
  EXPECT_EQ(fit.summary.status, Status::warning);
  EXPECT_TRUE(fit.xi.allFinite());
  const SparseFit lasso = solve(make_problem(d.theta, d.y), {.method = "lasso", .selection = Selection::cv});
  EXPECT_TRUE(lasso.xi.allFinite());
}

TEST(GramAccumulator, ManyBlocksAreMergedWithoutLosingRows) {
  GramAccumulator sums(1, 1, 1);
  double gram = 0, moment = 0;
  for (int k = 0; k < 5000; ++k) {
    const double x = std::cos(0.1 * k), y = 2 * x + std::sin(k);
    sums.add(Eigen::MatrixXd::Constant(1, 1, x), Eigen::MatrixXd::Constant(1, 1, y));
    gram += x * x;
    moment += x * y;
  }
  const Problem p = sums.problem(0);
  EXPECT_LE(p.blocks.size(), 1000u);
  EXPECT_GE(p.blocks.size(), 400u);
  EXPECT_NEAR(p.total.gram(0, 0), gram, 1e-9);
  EXPECT_NEAR(p.total.moment[0], moment, 1e-9);
  EXPECT_EQ(p.total.rows, 5000);
}

}  // namespace
}  // namespace whirl::regression
