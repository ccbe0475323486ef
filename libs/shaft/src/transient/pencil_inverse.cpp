#include "transient/pencil_inverse.hpp"

#include <Eigen/Eigenvalues>

#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;

PencilInverse::PencilInverse(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(a);
  const Eigen::ComplexSchur<Eigen::MatrixXcd> schur(lu.solve(b));
  to_ = schur.matrixU();
  schur_ = schur.matrixT();
  left_ = to_.adjoint() * lu.inverse();
}

void PencilInverse::solve(double w, Eigen::VectorXcd& inner, Eigen::VectorXcd& x) const {
  for (Index j = inner.size() - 1; j >= 0; --j) {
    inner[j] /= 1.0 + w * schur_(j, j);
    inner.head(j).noalias() -= (w * inner[j]) * schur_.col(j).head(j);
  }
  x.noalias() = to_ * inner;
}

}  // namespace whirl::shaft
