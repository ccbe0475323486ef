#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace whirl {

/// Cholesky factor A = L L^H of a Hermitian positive definite band matrix, in place, O(n b^2).
///
/// Eigen has no band solver (its sparse Cholesky needs an analysis and index arrays for what is a plain band).
/// Storage: `band(d, j)` = A(j + d, j), d = 0 .. bandwidth; columns of A are columns of `band`.
template <class Scalar>
class BandedCholesky {
 public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  BandedCholesky(Eigen::Index size, Eigen::Index bandwidth)
      : band(Matrix::Zero(bandwidth + 1, size)), size_(size), width_(bandwidth) {}

  /// False when the matrix is not positive definite to rounding.
  bool factorize() {
    for (Eigen::Index j = 0; j < size_; ++j) {
      const double pivot = std::real(band(0, j));
      if (!(pivot > 0) || !std::isfinite(pivot)) return false;
      const double root = std::sqrt(pivot);
      const Eigen::Index below = std::min(width_, size_ - 1 - j);
      band(0, j) = root;
      band.col(j).segment(1, below) /= root;
      for (Eigen::Index k = 1; k <= below; ++k) {
        const Scalar factor = conjugate(band(k, j));
        band.col(j + k).head(below - k + 1) -= factor * band.col(j).segment(k, below - k + 1);
      }
    }
    return true;
  }

  /// Overwrites b (size x columns) with L^-1 b: whitens rows whose covariance is A.
  void solve_lower(Eigen::Ref<Matrix> b) const {
    for (Eigen::Index c = 0; c < b.cols(); ++c) {
      for (Eigen::Index j = 0; j < size_; ++j) {
        const Eigen::Index below = std::min(width_, size_ - 1 - j);
        const Scalar v = b(j, c) / band(0, j);
        b(j, c) = v;
        b.col(c).segment(j + 1, below) -= v * band.col(j).segment(1, below);
      }
    }
  }

  /// Overwrites b with L^-H b.
  void solve_upper(Eigen::Ref<Matrix> b) const {
    for (Eigen::Index c = 0; c < b.cols(); ++c) {
      for (Eigen::Index j = size_ - 1; j >= 0; --j) {
        const Eigen::Index below = std::min(width_, size_ - 1 - j);
        b(j, c) = (b(j, c) - band.col(j).segment(1, below).dot(b.col(c).segment(j + 1, below))) / band(0, j);
      }
    }
  }

  Matrix band;  ///< A before, L after factorize()

 private:
  static Scalar conjugate(const Scalar& v) {
    if constexpr (Eigen::NumTraits<Scalar>::IsComplex) {
      return std::conj(v);
    } else {
      return v;
    }
  }

  Eigen::Index size_, width_;
};

}  // namespace whirl
