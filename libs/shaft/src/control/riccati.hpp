#pragma once
#include <Eigen/Core>

namespace whirl::shaft {

/// The stabilising solution X of X = A' X A - A' X B (R + B' X B)^-1 B' X A + Q by doubling (Chu, Fan, Lin and Wang,
/// Int. J. Control 77, 2004, 767-788), which needs no eigenvectors and takes A with poles outside the unit circle.
struct Riccati {
  Eigen::MatrixXd solution;
  double residual = 0;  ///< relative; NaN where there is no such solution
};
Riccati solve_riccati(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& q,
                      const Eigen::MatrixXd& r);

}  // namespace whirl::shaft
