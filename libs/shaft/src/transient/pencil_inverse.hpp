#pragma once
#include <Eigen/Core>

namespace whirl::shaft {

/// Solves (A + w B) x = b for many w by two products and a triangular system in place of a factorisation for each w:
/// with the Schur form A^-1 B = U T U* it is x = U (1 + w T)^-1 U* A^-1 b (Golub and Van Loan, Matrix Computations,
/// 2013, sec. 7.7). U is unitary, so that nothing is lost where eigenvectors are alike.
class PencilInverse {
 public:
  PencilInverse() = default;
  PencilInverse(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b);
  /// U* A^-1: what every right side is multiplied by first.
  const Eigen::MatrixXcd& left() const { return left_; }
  /// x = (A + w B)^-1 b from `inner` = left() b, which is used up; nothing is allocated where x has its size.
  void solve(double w, Eigen::Ref<Eigen::VectorXcd> inner, Eigen::VectorXcd& x) const;

 private:
  Eigen::MatrixXcd left_, schur_, to_;  // U* A^-1, T, U
};

}  // namespace whirl::shaft
