#include "whirl/rotor/mode_step.hpp"

#include <unsupported/Eigen/MatrixFunctions>

#include "whirl/core/decompositions.hpp"

namespace whirl::rotor {

ModeStep::ModeStep(double omega, double zeta, double h) {
  // State (q, q') augmented by p, p', p'' of f(t) = p + p' t + p'' t^2 / 2.
  Eigen::Matrix<double, 5, 5> a = Eigen::Matrix<double, 5, 5>::Zero();
  a(0, 1) = a(1, 2) = a(2, 3) = a(3, 4) = 1;
  a(1, 0) = -omega * omega;
  a(1, 1) = -2 * zeta * omega;
  const Eigen::Matrix<double, 5, 5> scaled = a * h;
  const Eigen::Matrix<double, 5, 5> e = scaled.exp();
  state_ = e.topLeftCorner<2, 2>();
  Eigen::Matrix3d derivatives;  // (f0, f_mid, f1) -> (p, p', p'')
  derivatives << 1, 0, 0, -3 / h, 4 / h, -1 / h, 4 / (h * h), -8 / (h * h), 4 / (h * h);
  input_ = e.topRightCorner<2, 3>() * derivatives;
}

}  // namespace whirl::rotor
