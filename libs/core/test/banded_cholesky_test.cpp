#include "whirl/core/banded_cholesky.hpp"

#include <gtest/gtest.h>

#include <complex>
#include <random>

#include "whirl/core/decompositions.hpp"

namespace whirl {
namespace {

TEST(BandedCholeskyProperty, SolvesAsTheDenseFactor) {
  using Complex = std::complex<double>;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const int width : {0, 1, 4, 19}) {
    const int n = 20;
    BandedCholesky<Complex> chol(n, width);
    Eigen::MatrixXcd dense = Eigen::MatrixXcd::Zero(n, n);
    for (int j = 0; j < n; ++j) {
      for (int d = 0; d <= width && j + d < n; ++d) {
        const Complex v = d == 0 ? Complex(2.0 * width + 1) : Complex(uniform(random), uniform(random)) * 0.7;
        dense(j + d, j) = v;
        dense(j, j + d) = std::conj(v);
        chol.band(d, j) = v;
      }
    }
    Eigen::MatrixXcd b = Eigen::MatrixXcd::Random(n, 3);
    const Eigen::MatrixXcd right = b;
    ASSERT_TRUE(chol.factorize());
    chol.solve_lower(b);
    // ||L^-1 b||^2 = b^H A^-1 b
    EXPECT_NEAR(b.squaredNorm(), (right.adjoint() * dense.ldlt().solve(right)).trace().real(), 1e-10);
    chol.solve_upper(b);
    EXPECT_LT((dense * b - right).norm(), 1e-11 * right.norm());
  }
}

TEST(BandedCholesky, RefusesAnIndefiniteMatrix) {
  BandedCholesky<double> chol(2, 1);
  chol.band << 1, 1, 2, 0;
  EXPECT_FALSE(chol.factorize());
}

}  // namespace
}  // namespace whirl
