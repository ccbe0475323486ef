#include "eigenpairs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Complex = std::complex<double>;

namespace {

constexpr Index kBlock = 4;                // more than the multiplicity of an eigenvalue
constexpr double kInverseResidual = 1e-9;  // of an eigenpair of the inverse, relative
constexpr double kOverdamped = 1e-6;       // |Im| / |pole| below which a pole does not oscillate
constexpr double kLost = 1e-10;            // a new direction of the basis that is shorter than this is rounding

/// (s - A)^-1 of the first-order form y = (w0 q, q') at a real shift s, applied to columns:
/// (s^2 M + s C + K) q = M r2 + (s M + C) r1, q' = s q - r1.
template <class Matrix>
class InverseOperator {
 public:
  explicit InverseOperator(const Equations<Matrix>& e) : e_(e) {
    const Matrix dynamic = shift_ * shift_ * e.mass + shift_ * e.damping + e.stiffness;
    lu_.compute(dynamic);
    // Scale of time: frequency of the deflection under an even acceleration.
    const Matrix ones = Matrix::Ones(e.mass.rows(), 1);
    const Matrix force = e.mass * ones, sag = lu_.solve(force);
    const double energy = std::abs((sag.adjoint() * force)(0, 0)),
                 motion = std::abs((sag.adjoint() * e.mass * sag)(0, 0));
    if (energy > 0 && motion > 0) scale_ = std::max(1.0, std::sqrt(energy / motion));
  }
  double shift() const { return shift_; }

  Matrix apply(const Matrix& y) const {
    const Index n = e_.mass.rows();
    const Matrix r1 = y.topRows(n) / scale_, r2 = y.bottomRows(n);
    const Matrix right = e_.mass * r2 + shift_ * (e_.mass * r1) + e_.damping * r1;
    const Matrix q = lu_.solve(right);
    Matrix out(2 * n, y.cols());
    out.topRows(n) = scale_ * q;
    out.bottomRows(n) = shift_ * q - r1;
    return out;
  }

 private:
  const Equations<Matrix>& e_;
  double shift_ = 1;  // 1/s, so that a free rotor has an inverse
  double scale_ = 1;
  Eigen::PartialPivLU<Matrix> lu_;
};

/// Orthonormal columns of `added` beside `basis` (two passes of Gram-Schmidt), appended to it.
template <class Matrix>
void append(Matrix& basis, Index& used, const Matrix& added) {
  for (Index k = 0; k < added.cols() && used < basis.cols(); ++k) {
    Matrix v = added.col(k);
    const double before = v.norm();
    if (!(before > 0)) continue;
    v /= before;
    for (int pass = 0; pass < 2; ++pass) v -= basis.leftCols(used) * (basis.leftCols(used).adjoint() * v);
    if (v.norm() < kLost) continue;
    basis.col(used++) = v / v.norm();
  }
}

template <class Matrix>
Matrix krylov_basis(const InverseOperator<Matrix>& inverse, Index states, Index size) {
  Matrix basis = Matrix::Zero(states, size);
  Matrix block(states, kBlock);
  unsigned state = 12345;  // numbers that are the same in every run
  for (Index i = 0; i < states; ++i)
    for (Index j = 0; j < kBlock; ++j) {
      state = state * 1664525u + 1013904223u;
      block(i, j) = static_cast<double>(state >> 8) / (1 << 24) - 0.5;
    }
  Index used = 0, from = 0;
  append(basis, used, inverse.apply(block));
  while (used < size && from < used) {
    const Matrix last = basis.middleCols(from, used - from);
    from = used;
    append(basis, used, inverse.apply(last));
  }
  return basis.leftCols(used);
}

void solve_small(const MatrixXd& h, VectorXcd& values, MatrixXcd& vectors) {
  const Eigen::EigenSolver<MatrixXd> solver(h);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}
void solve_small(const MatrixXcd& h, VectorXcd& values, MatrixXcd& vectors) {
  const Eigen::ComplexEigenSolver<MatrixXcd> solver(h);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

}  // namespace

template <class Matrix>
std::vector<Eigenpair> lowest_pairs(const Equations<Matrix>& e, int count) {
  constexpr bool real = std::is_same_v<Matrix, MatrixXd>;
  const Index n = e.mass.rows(), states = 2 * n, wanted = count * (real ? 2 : 1) + 8;
  const InverseOperator<Matrix> inverse(e);
  for (Index size = std::max<Index>(2 * wanted + 16, 48);; size = size * 8 / 5) {
    const bool whole = size * 4 >= states * 3;
    Matrix basis;
    if (!whole) basis = krylov_basis(inverse, states, size);
    const Matrix image = inverse.apply(whole ? Matrix(Matrix::Identity(states, states)) : basis);
    VectorXcd values;
    MatrixXcd vectors;
    solve_small(whole ? image : Matrix(basis.adjoint() * image), values, vectors);
    std::vector<Eigenpair> pairs;
    std::vector<Index> order(static_cast<std::size_t>(values.size()));
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Index>(k);
    const auto pole = [&](Index k) { return inverse.shift() - 1.0 / values[k]; };
    std::erase_if(order, [&](Index k) {
      const Complex p = pole(k);
      return !std::isfinite(std::abs(p)) || std::abs(p.imag()) <= kOverdamped * std::abs(p) || (real && p.imag() < 0);
    });
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return std::abs(pole(a)) < std::abs(pole(b)); });
    double worst = 0;
    for (const Index k : order) {
      if (pairs.size() == static_cast<std::size_t>(count)) break;
      // The image of a Ritz vector is nearer to the eigenvector than itself.
      const VectorXcd state = image * vectors.col(k), ritz = whole ? vectors.col(k) : VectorXcd(basis * vectors.col(k));
      worst = std::max(worst, (state - values[k] * ritz).norm() / state.norm());
      Eigenpair pair{pole(k), state.head(n)};
      pair.shape /= pair.shape.norm();
      pairs.push_back(std::move(pair));
    }
    const bool complete = pairs.size() == static_cast<std::size_t>(count);
    if (whole || (complete && worst < kInverseResidual)) {
      if (!(worst < 1e-5)) throw Error("the modes of the rotor could not be found: its equations are singular");
      return pairs;
    }
  }
}

template std::vector<Eigenpair> lowest_pairs(const Equations<MatrixXd>&, int);
template std::vector<Eigenpair> lowest_pairs(const Equations<MatrixXcd>&, int);

}  // namespace whirl::shaft
