#include "whirl/core/riccati.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <random>

namespace whirl {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// x = a x + u with unit weights: X^2 - a^2 X - 1 = 0, also where a turns.
TEST(RiccatiReference, OneState) {
  for (const double a : {0.5, 1.0, 2.0, 30.0}) {
    const double expected = (a * a + std::sqrt(a * a * a * a + 4)) / 2;
    const MatrixXd one = MatrixXd::Ones(1, 1);
    EXPECT_NEAR(solve_riccati<MatrixXd>(a * one, one, one, one).solution(0, 0) / expected, 1, 1e-12);
    const MatrixXcd turned = std::polar(a, 0.7) * one, unit = one.cast<std::complex<double>>();
    EXPECT_NEAR(std::abs(solve_riccati<MatrixXcd>(turned, unit, unit, unit).solution(0, 0)) / expected, 1, 1e-12);
  }
}

template <class Matrix>
void expect_stable(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  for (int run = 0; run < 100; ++run) {
    const int n = 2 + run % 9;
    const auto draw = [&](int rows, int cols) {
      Matrix m(rows, cols);
      for (auto& entry : m.reshaped()) {
        if constexpr (std::is_same_v<Matrix, MatrixXd>)
          entry = normal(random);
        else
          entry = {normal(random), normal(random)};
      }
      return m;
    };
    const Matrix a = draw(n, n), b = draw(n, 2), q = Matrix::Identity(n, n), r = Matrix::Identity(2, 2);
    const Riccati<Matrix> x = solve_riccati<Matrix>(a, b, q, r);
    ASSERT_LT(x.residual, 1e-9) << run;
    EXPECT_LT(Matrix(a - b * riccati_gain<Matrix>(a, b, r, x.solution)).eigenvalues().cwiseAbs().maxCoeff(), 1) << run;
  }
}

TEST(RiccatiProperty, StabilisesRandomSystems) {
  std::mt19937_64 random(11);
  expect_stable<MatrixXd>(random);
  expect_stable<MatrixXcd>(random);
}

/// What no force reaches and what grows has no such solution.
TEST(RiccatiRefusal, WhatIsOutOfReach) {
  MatrixXd a = 2 * MatrixXd::Identity(2, 2), b = MatrixXd::Zero(2, 1);
  a(1, 1) = 0.5, b(1, 0) = 1;
  const Riccati<MatrixXd> x = solve_riccati<MatrixXd>(a, b, MatrixXd::Identity(2, 2), MatrixXd::Identity(1, 1));
  EXPECT_FALSE(x.residual < 1e-6);
}

}  // namespace
}  // namespace whirl
