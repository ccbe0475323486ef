#include "whirl/core/riccati.hpp"

#include "whirl/core/decompositions.hpp"
#include "whirl/core/nan.hpp"

namespace whirl {

template <class Matrix>
Matrix riccati_gain(const Matrix& a, const Matrix& b, const Matrix& r, const Matrix& solution) {
  const Matrix xb = solution * b;
  return Eigen::PartialPivLU<Matrix>(Matrix(r + b.adjoint() * xb)).solve(Matrix(xb.adjoint() * a));
}

template <class Matrix>
Riccati<Matrix> solve_riccati(const Matrix& a, const Matrix& b, const Matrix& q, const Matrix& r) {
  constexpr int kDoublings = 60;
  const Eigen::Index n = a.rows();
  Matrix f = a, g = b * Eigen::LLT<Matrix>(r).solve(Matrix(b.adjoint())), h = q;
  const Matrix one = Matrix::Identity(n, n);
  bool settled = false;
  for (int k = 0; k < kDoublings && !settled; ++k) {
    const Eigen::PartialPivLU<Matrix> lu(Matrix(one + g * h));
    const Matrix wf = lu.solve(f), wg = lu.solve(Matrix(g * f.adjoint()));
    const Matrix step = f.adjoint() * h * wf;
    g = (g + f * wg).eval();
    h += step;
    f = (f * wf).eval();
    g = ((g + g.adjoint()) / 2).eval();
    h = ((h + h.adjoint()) / 2).eval();
    settled = step.norm() <= 1e-14 * h.norm();
    if (!h.allFinite()) break;
  }
  if (!settled || !h.allFinite()) return {h, kNaN};
  const Matrix rest = a.adjoint() * h * a - a.adjoint() * h * b * riccati_gain(a, b, r, h) + q - h;
  return {h, rest.norm() / h.norm()};
}

template Riccati<Eigen::MatrixXd> solve_riccati(const Eigen::MatrixXd&, const Eigen::MatrixXd&, const Eigen::MatrixXd&,
                                                const Eigen::MatrixXd&);
template Riccati<Eigen::MatrixXcd> solve_riccati(const Eigen::MatrixXcd&, const Eigen::MatrixXcd&,
                                                 const Eigen::MatrixXcd&, const Eigen::MatrixXcd&);
template Eigen::MatrixXd riccati_gain(const Eigen::MatrixXd&, const Eigen::MatrixXd&, const Eigen::MatrixXd&,
                                      const Eigen::MatrixXd&);
template Eigen::MatrixXcd riccati_gain(const Eigen::MatrixXcd&, const Eigen::MatrixXcd&, const Eigen::MatrixXcd&,
                                       const Eigen::MatrixXcd&);

}  // namespace whirl
