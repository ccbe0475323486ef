#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

// Eigen's decompositions of matrices of dynamic size, compiled once in this library: a unit that includes this header
// in place of Eigen's own uses them as ever, but does not compile them anew (a complex singular value decomposition
// takes 40 s, a complex eigensolver 10 s, a pivoted QR 6 s a unit). Only plain matrices are prepared: an expression as
// argument or right-hand side is compiled where it stands, so pass `MatrixXd(expression)`.

// INSTANTIATE is `extern template` here and `template` in the one source that holds the code.
#define WHIRL_SOLVER(INSTANTIATE, Solver, Matrix, Vector)                                     \
  INSTANTIATE class Solver<Matrix>;                                                           \
  INSTANTIATE void Solver<Matrix>::_solve_impl<Matrix, Matrix>(const Matrix&, Matrix&) const; \
  INSTANTIATE void Solver<Matrix>::_solve_impl<Vector, Vector>(const Vector&, Vector&) const;
#define WHIRL_CHOLESKY(INSTANTIATE, Solver, Matrix, Vector) \
  WHIRL_SOLVER(INSTANTIATE, Solver, Matrix, Vector)         \
  INSTANTIATE Solver<Matrix>& Solver<Matrix>::compute(const EigenBase<Matrix>&);
#define WHIRL_EIGENSOLVER(INSTANTIATE, Solver, Matrix, Options) \
  INSTANTIATE class Solver<Matrix>;                             \
  INSTANTIATE Solver<Matrix>& Solver<Matrix>::compute(const EigenBase<Matrix>&, Options);
// Products of a matrix by columns or by rows with a vector, without conjugation.
#define WHIRL_MATRIX_VECTOR(INSTANTIATE, T)                                               \
  INSTANTIATE struct internal::general_matrix_vector_product<                             \
      Index, T, internal::const_blas_data_mapper<T, Index, ColMajor>, ColMajor, false, T, \
      internal::const_blas_data_mapper<T, Index, RowMajor>, false, 0>;                    \
  INSTANTIATE struct internal::general_matrix_vector_product<                             \
      Index, T, internal::const_blas_data_mapper<T, Index, RowMajor>, RowMajor, false, T, \
      internal::const_blas_data_mapper<T, Index, ColMajor>, false, 0>;                    \
  INSTANTIATE struct internal::general_matrix_vector_product<                             \
      Index, T, internal::const_blas_data_mapper<T, Index, RowMajor>, RowMajor, false, T, \
      internal::const_blas_data_mapper<T, Index, RowMajor>, false, 1>;

namespace Eigen {

WHIRL_CHOLESKY(extern template, LLT, MatrixXd, VectorXd)
WHIRL_CHOLESKY(extern template, LDLT, MatrixXd, VectorXd)
WHIRL_CHOLESKY(extern template, LLT, MatrixXcd, VectorXcd)
WHIRL_SOLVER(extern template, HouseholderQR, MatrixXd, VectorXd)
WHIRL_SOLVER(extern template, ColPivHouseholderQR, MatrixXd, VectorXd)
WHIRL_SOLVER(extern template, CompleteOrthogonalDecomposition, MatrixXd, VectorXd)
WHIRL_EIGENSOLVER(extern template, SelfAdjointEigenSolver, MatrixXd, int)
WHIRL_EIGENSOLVER(extern template, ComplexEigenSolver, MatrixXcd, bool)
WHIRL_EIGENSOLVER(extern template, EigenSolver, MatrixXd, bool)
WHIRL_MATRIX_VECTOR(extern template, double)
WHIRL_MATRIX_VECTOR(extern template, std::complex<double>)
extern template class PartialPivLU<MatrixXd>;
extern template class PartialPivLU<MatrixXcd>;
extern template class JacobiSVD<MatrixXd>;
extern template class JacobiSVD<MatrixXcd>;
extern template class internal::UpperBidiagonalization<MatrixXcd>;
extern template class BDCSVD<MatrixXcd>;

}  // namespace Eigen

namespace whirl {

/// Inverse of a square matrix by LU with partial pivots.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& a);

}  // namespace whirl
