#include "transient/pencil_inverse.hpp"

#include <Eigen/Eigenvalues>

#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;

PencilInverse::PencilInverse(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  const Eigen::PartialPivLU<Eigen::MatrixXcd> lu(a);
  const Eigen::ComplexSchur<Eigen::MatrixXcd> schur(Eigen::MatrixXcd(lu.solve(b)));
  to_ = schur.matrixU();
  schur_ = schur.matrixT();
  left_ = to_.adjoint() * lu.inverse();
}

void PencilInverse::solve(double w, Eigen::Ref<Eigen::VectorXcd> inner, Eigen::VectorXcd& x) const {
  // Written out: division and product of std::complex look for infinities at every call.
  for (Index j = inner.size() - 1; j >= 0; --j) {
    const double real = 1 + w * schur_(j, j).real(), imaginary = w * schur_(j, j).imag();
    const double scale = 1 / (real * real + imaginary * imaginary);
    const std::complex<double> z = inner[j];
    const double x_real = scale * (z.real() * real + z.imag() * imaginary),
                 x_imaginary = scale * (z.imag() * real - z.real() * imaginary);
    inner[j] = {x_real, x_imaginary};
    inner.head(j).noalias() -= std::complex<double>(w * x_real, w * x_imaginary) * schur_.col(j).head(j);
  }
  x.noalias() = to_ * inner;
}

}  // namespace whirl::shaft
