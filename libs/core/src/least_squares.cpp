#include "whirl/core/least_squares.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCholesky>

namespace whirl {
namespace {

constexpr Eigen::Index kSmall = 100;
constexpr double kSparse = 0.1;  // share of numbers that are not zero

/// Lower half of D M D, D = diag(factor), with `more` added to its diagonal, which is `none` where M has no positive
/// number there; nothing where M is small or full.
std::optional<Eigen::SparseMatrix<double>> sparse_half(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& factor,
                                                       double none, double more) {
  const Eigen::Index n = matrix.rows();
  if (n < kSmall) return {};
  Eigen::SparseMatrix<double> half(n, n);
  const auto most = static_cast<Eigen::Index>(0.5 * kSparse * static_cast<double>(n * n)) + n;
  half.reserve(most);
  Eigen::Index count = 0;
  for (Eigen::Index j = 0; j < n; ++j) {
    half.startVec(j);
    const double* column = matrix.data() + j * matrix.outerStride();
    for (Eigen::Index i = j; i < n; ++i) {
      if (i > j && column[i] == 0) continue;
      if (++count > most) return {};
      const double value = factor[i] * column[i] * factor[j];
      half.insertBack(i, j) = i > j ? value : (column[i] > 0 ? value : none) + more;
    }
  }
  half.finalize();
  return half;
}

}  // namespace

std::optional<Eigen::MatrixXd> solve_sparse(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right) {
  const auto half = sparse_half(matrix, Eigen::VectorXd::Ones(matrix.rows()), 0, 0);
  if (!half) return {};
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt(*half);
  if (llt.info() != Eigen::Success) return {};
  return llt.solve(right);
}

bool damped_step(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, double damping,
                 Eigen::VectorXd& step) {
  const Eigen::VectorXd scale = (normal.diagonal().array() > 0).select(normal.diagonal().cwiseSqrt(), 1.0);
  const Eigen::VectorXd right = gradient.cwiseQuotient(scale), factor = scale.cwiseInverse();
  if (const auto half = sparse_half(normal, factor, 1, damping)) {
    const Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> llt(*half);
    if (llt.info() != Eigen::Success) return false;
    step = llt.solve(right).cwiseQuotient(scale);
    return step.allFinite();
  }
  Eigen::MatrixXd scaled = factor.asDiagonal() * normal * factor.asDiagonal();
  scaled.diagonal() = (normal.diagonal().array() > 0).select(scaled.diagonal(), 1.0);
  scaled.diagonal().array() += damping;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  if (llt.info() != Eigen::Success) return false;
  step = llt.solve(right).cwiseQuotient(scale);
  return step.allFinite();
}

InverseInformation invert_information(const Eigen::MatrixXd& normal, double least) {
  InverseInformation inverse;
  const Eigen::Index n = normal.rows();
  inverse.condition_number = std::numeric_limits<double>::infinity();
  if (n == 0 || (least == 0 && !(normal.diagonal().minCoeff() > 0))) return inverse;
  const Eigen::VectorXd scale = (normal.diagonal().array() > 0).select(normal.diagonal().cwiseSqrt(), 1.0);
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const double lowest = eigen.eigenvalues()[0], highest = eigen.eigenvalues()[n - 1];
  if (lowest > 0) inverse.condition_number = std::sqrt(highest / lowest);
  if (least == 0 && !(lowest > 1e-13 * highest)) return inverse;
  const Eigen::VectorXd kept = eigen.eigenvalues().cwiseMax(least * std::max(highest, 1e-300));
  inverse.covariance = scale.cwiseInverse().asDiagonal() *
                       (eigen.eigenvectors() * kept.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose()) *
                       scale.cwiseInverse().asDiagonal();
  return inverse;
}

Eigen::MatrixXd marginal_information(const Eigen::MatrixXd& normal, Eigen::Index kept) {
  const Eigen::Index others = normal.rows() - kept;
  if (others == 0 || kept == 0) return normal.topLeftCorner(kept, kept);  // nothing left to eliminate, or to keep
  const auto diagonal = normal.diagonal().tail(others).array();
  const Eigen::VectorXd scale = (diagonal > 0).select(diagonal.sqrt().inverse(), 1.0);
  Eigen::MatrixXd own = scale.asDiagonal() * normal.bottomRightCorner(others, others) * scale.asDiagonal();
  own.diagonal().array() += 1e-13;
  const Eigen::MatrixXd with = scale.asDiagonal() * normal.bottomLeftCorner(others, kept);
  const std::optional<Eigen::MatrixXd> sparse = solve_sparse(own, with);
  return normal.topLeftCorner(kept, kept) - with.transpose() * (sparse ? *sparse : own.ldlt().solve(with));
}

}  // namespace whirl
