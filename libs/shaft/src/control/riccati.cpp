#include "control/riccati.hpp"

#include "whirl/core/decompositions.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::shaft {

using Eigen::MatrixXd;

Riccati solve_riccati(const MatrixXd& a, const MatrixXd& b, const MatrixXd& q, const MatrixXd& r) {
  constexpr int kDoublings = 60;
  const Eigen::Index n = a.rows();
  MatrixXd f = a, g = b * Eigen::LLT<MatrixXd>(r).solve(MatrixXd(b.transpose())), h = q;
  const MatrixXd one = MatrixXd::Identity(n, n);
  bool settled = false;
  for (int k = 0; k < kDoublings && !settled; ++k) {
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd(one + g * h));
    const MatrixXd wf = lu.solve(f), wg = lu.solve(MatrixXd(g * f.transpose()));
    const MatrixXd step = f.transpose() * h * wf;
    g = (g + f * wg).eval();
    h += step;
    f = (f * wf).eval();
    g = ((g + g.transpose()) / 2).eval();
    h = ((h + h.transpose()) / 2).eval();
    settled = step.norm() <= 1e-14 * h.norm();
    if (!h.allFinite()) break;
  }
  if (!settled || !h.allFinite()) return {h, kNaN};
  const MatrixXd xb = h * b;
  const MatrixXd gain =
      Eigen::PartialPivLU<MatrixXd>(MatrixXd(r + b.transpose() * xb)).solve(MatrixXd(xb.transpose() * a));
  const MatrixXd rest = a.transpose() * h * a - a.transpose() * xb * gain + q - h;
  return {h, rest.norm() / h.norm()};
}

}  // namespace whirl::shaft
