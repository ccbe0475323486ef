#pragma once
#include <Eigen/Core>

namespace whirl {

/// The stabilising solution X of X = A* X A - A* X B (R + B* X B)^-1 B* X A + Q by doubling (Chu, Fan, Lin and Wang,
/// Int. J. Control 77, 2004, 767-788), which needs no eigenvectors and takes A with poles outside the unit circle.
/// Matrix: MatrixXd or MatrixXcd.
template <class Matrix>
struct Riccati {
  Matrix solution;
  double residual = 0;  ///< relative; NaN where there is no such solution
};
template <class Matrix>
Riccati<Matrix> solve_riccati(const Matrix& a, const Matrix& b, const Matrix& q, const Matrix& r);

/// The feedback u = -K x of it: K = (R + B* X B)^-1 B* X A.
template <class Matrix>
Matrix riccati_gain(const Matrix& a, const Matrix& b, const Matrix& r, const Matrix& solution);

}  // namespace whirl
