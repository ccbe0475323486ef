#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "whirl/core/products.hpp"

// Eigen's decompositions of matrices of dynamic size, compiled once in this library: a unit that includes this header
// in place of Eigen's own uses them as ever, but does not compile them anew (a complex singular value decomposition
// takes 40 s, a complex eigensolver 10 s, a pivoted QR 6 s a unit). Only plain matrices are prepared: an expression as
// argument or right-hand side is compiled where it stands, so pass `MatrixXd(expression)`.

// INSTANTIATE is `extern template` here and `template` in the one source that holds the code.
#define WHIRL_SOLUTION(INSTANTIATE, Solver, Matrix, Vector)                                   \
  INSTANTIATE void Solver<Matrix>::_solve_impl<Matrix, Matrix>(const Matrix&, Matrix&) const; \
  INSTANTIATE void Solver<Matrix>::_solve_impl<Vector, Vector>(const Vector&, Vector&) const;
#define WHIRL_CHOLESKY(INSTANTIATE, Solver, Matrix, Vector)                      \
  INSTANTIATE Solver<Matrix>::Solver(const EigenBase<Matrix>&);                  \
  INSTANTIATE Solver<Matrix>& Solver<Matrix>::compute(const EigenBase<Matrix>&); \
  WHIRL_SOLUTION(INSTANTIATE, Solver, Matrix, Vector)
#define WHIRL_QR(INSTANTIATE, Solver, Matrix, Vector)           \
  INSTANTIATE Solver<Matrix>::Solver(const EigenBase<Matrix>&); \
  INSTANTIATE void Solver<Matrix>::computeInPlace();            \
  WHIRL_SOLUTION(INSTANTIATE, Solver, Matrix, Vector)
#define WHIRL_EIGENSOLVER(INSTANTIATE, Solver, Matrix, Options)          \
  INSTANTIATE Solver<Matrix>::Solver(const EigenBase<Matrix>&, Options); \
  INSTANTIATE Solver<Matrix>& Solver<Matrix>::compute(const EigenBase<Matrix>&, Options);
// What decompositions of any argument end in, an expression's too: reflections applied in blocks to a matrix or a
// vector, the tridiagonal form. The last argument is the type of their coefficients.
#define WHIRL_REFLECTION(INSTANTIATE, Target, T, ...)                                                    \
  INSTANTIATE void internal::apply_block_householder_on_the_left(                                        \
      Block<Target>&, const Block<Matrix<T, Dynamic, Dynamic>>&, const VectorBlock<__VA_ARGS__>&, bool); \
  INSTANTIATE void MatrixBase<Block<Target>>::applyHouseholderOnTheLeft(                                 \
      const Block<const Matrix<T, Dynamic, Dynamic>, Dynamic, 1>&, const T&, T*);
#define WHIRL_REFLECTIONS(INSTANTIATE, T, Matrix, Vector, ...)                                                   \
  WHIRL_REFLECTION(INSTANTIATE, Matrix, T, __VA_ARGS__)                                                          \
  WHIRL_REFLECTION(INSTANTIATE, Vector, T, __VA_ARGS__)                                                          \
  INSTANTIATE void MatrixBase<Block<Matrix>>::applyHouseholderOnTheRight(const Block<const Matrix, Dynamic, 1>&, \
                                                                         const T&, T*);                          \
  INSTANTIATE void MatrixBase<Block<Matrix>>::applyHouseholderOnTheLeft(                                         \
      const VectorBlock<Block<Matrix, Dynamic, 1, true>>&, const T&, T*);                                        \
  INSTANTIATE void internal::tridiagonalization_inplace(Matrix&, Vector&);                                       \
  INSTANTIATE ComputationInfo internal::computeFromTridiagonal_impl(VectorXd&, VectorXd&, Index, bool, Matrix&);
#define WHIRL_REFLECTIONS_REAL(INSTANTIATE) WHIRL_REFLECTIONS(INSTANTIATE, double, MatrixXd, VectorXd, const VectorXd)
#define WHIRL_REFLECTIONS_COMPLEX(INSTANTIATE)                               \
  WHIRL_REFLECTIONS(INSTANTIATE, std::complex<double>, MatrixXcd, VectorXcd, \
                    const CwiseUnaryOp<internal::scalar_conjugate_op<std::complex<double>>, const VectorXcd>)

namespace Eigen {

WHIRL_CHOLESKY(extern template, LLT, MatrixXd, VectorXd)
WHIRL_CHOLESKY(extern template, LDLT, MatrixXd, VectorXd)
WHIRL_CHOLESKY(extern template, LLT, MatrixXcd, VectorXcd)
WHIRL_CHOLESKY(extern template, LDLT, MatrixXcd, VectorXcd)
WHIRL_QR(extern template, HouseholderQR, MatrixXd, VectorXd)
WHIRL_QR(extern template, HouseholderQR, MatrixXcd, VectorXcd)
WHIRL_QR(extern template, ColPivHouseholderQR, MatrixXd, VectorXd)
WHIRL_QR(extern template, ColPivHouseholderQR, MatrixXcd, VectorXcd)
WHIRL_QR(extern template, CompleteOrthogonalDecomposition, MatrixXd, VectorXd)
WHIRL_QR(extern template, CompleteOrthogonalDecomposition, MatrixXcd, VectorXcd)
WHIRL_EIGENSOLVER(extern template, SelfAdjointEigenSolver, MatrixXd, int)
WHIRL_EIGENSOLVER(extern template, SelfAdjointEigenSolver, MatrixXcd, int)
WHIRL_EIGENSOLVER(extern template, ComplexEigenSolver, MatrixXcd, bool)
WHIRL_EIGENSOLVER(extern template, ComplexSchur, MatrixXcd, bool)
WHIRL_EIGENSOLVER(extern template, EigenSolver, MatrixXd, bool)
WHIRL_EIGENSOLVER(extern template, RealSchur, MatrixXd, bool)
WHIRL_REFLECTIONS_REAL(extern template)
WHIRL_REFLECTIONS_COMPLEX(extern template)
extern template void PartialPivLU<MatrixXd>::compute();
extern template void PartialPivLU<MatrixXcd>::compute();
extern template PartialPivLU<MatrixXd>::PartialPivLU(const EigenBase<MatrixXd>&);
extern template PartialPivLU<MatrixXcd>::PartialPivLU(const EigenBase<MatrixXcd>&);
extern template JacobiSVD<MatrixXd>& JacobiSVD<MatrixXd>::compute(const MatrixXd&, unsigned);
extern template JacobiSVD<MatrixXcd>& JacobiSVD<MatrixXcd>::compute(const MatrixXcd&, unsigned);
extern template class internal::UpperBidiagonalization<MatrixXcd>;
extern template BDCSVD<MatrixXcd>& BDCSVD<MatrixXcd>::compute(const MatrixXcd&, unsigned);

}  // namespace Eigen

namespace whirl {

/// Inverse of a square matrix by LU with partial pivots.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& a);

}  // namespace whirl
