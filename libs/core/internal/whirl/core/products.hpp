#pragma once
#include <Eigen/Core>
#include <complex>

// Eigen's kernels of products and of solutions with triangles, of real and complex numbers, compiled once in this
// library. Every unit that multiplies two matrices would compile them anew: unrolled for the widest registers of the
// processor they are a tenth of all the code that a build compiles. What stands here is `extern template`; the code is
// in src/products/*.cpp.

// Lists of the kernels; INSTANTIATE is `extern template` here and `template` in the one source that holds the code.
#define WHIRL_KERNEL(INSTANTIATE, L, R, ConjugateL, ConjugateR)                                         \
  INSTANTIATE struct internal::gebp_kernel<                                                             \
      L, R, Index, internal::blas_data_mapper<ScalarBinaryOpTraits<L, R>::ReturnType, Index, ColMajor>, \
      internal::gebp_traits<L, R>::mr, internal::gebp_traits<L, R>::nr, ConjugateL, ConjugateR>;
#define WHIRL_PACK_LEFT(INSTANTIATE, L, R, Order)                                                   \
  INSTANTIATE struct internal::gemm_pack_lhs<                                                       \
      L, Index, internal::const_blas_data_mapper<L, Index, Order>, internal::gebp_traits<L, R>::mr, \
      internal::gebp_traits<L, R>::LhsProgress, internal::gebp_traits<L, R>::LhsPacket4Packing, Order>;
#define WHIRL_PACK_RIGHT(INSTANTIATE, L, R, Order)                                                        \
  INSTANTIATE struct internal::gemm_pack_rhs<R, Index, internal::const_blas_data_mapper<R, Index, Order>, \
                                             internal::gebp_traits<L, R>::nr, Order>;
#define WHIRL_PACK(INSTANTIATE, T)                                                                     \
  WHIRL_PACK_LEFT(INSTANTIATE, T, T, ColMajor)                                                         \
  WHIRL_PACK_LEFT(INSTANTIATE, T, T, RowMajor)                                                         \
  WHIRL_PACK_RIGHT(INSTANTIATE, T, T, ColMajor)                                                        \
  WHIRL_PACK_RIGHT(INSTANTIATE, T, T, RowMajor)                                                        \
  INSTANTIATE struct internal::gemm_pack_rhs<T, Index, internal::blas_data_mapper<T, Index, ColMajor>, \
                                             internal::gebp_traits<T, T>::nr, ColMajor, false, true>;  \
  INSTANTIATE struct internal::gemm_pack_lhs<T, Index, internal::blas_data_mapper<T, Index, ColMajor>, \
                                             internal::gebp_traits<T, T>::mr,                          \
                                             internal::gebp_traits<T, T>::LhsProgress,                 \
                                             internal::gebp_traits<T, T>::LhsPacket4Packing, ColMajor, false, true>;
// A matrix by columns or by rows with a vector; R2 is the layout that Eigen names the vector by.
#define WHIRL_MATRIX_VECTOR(INSTANTIATE, L, Order, ConjugateL, R, R2, ConjugateR, Version) \
  INSTANTIATE struct internal::general_matrix_vector_product<                              \
      Index, L, internal::const_blas_data_mapper<L, Index, Order>, Order, ConjugateL, R,   \
      internal::const_blas_data_mapper<R, Index, R2>, ConjugateR, Version>;
// A triangle of a matrix by columns or by rows, from the left: its solution, its product.
#define WHIRL_TRIANGLE_SOLVE(INSTANTIATE, T, Side, Mode, Conjugate, Order) \
  INSTANTIATE struct internal::triangular_solve_matrix<T, Index, Side, Mode, Conjugate, Order, ColMajor, 1>;
#define WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, T, Mode, Conjugate, Order)                                            \
  INSTANTIATE struct internal::product_triangular_matrix_matrix<T, Index, Mode, true, Order, Conjugate, ColMajor, \
                                                                false, ColMajor, 1>;
#define WHIRL_BLOCKING(INSTANTIATE, L, R)                                                                          \
  INSTANTIATE void internal::evaluateProductBlockingSizesHeuristic<L, R, 1, Index>(Index&, Index&, Index&, Index); \
  INSTANTIATE void internal::evaluateProductBlockingSizesHeuristic<L, R, 4, Index>(Index&, Index&, Index&, Index);
// The loop over blocks, of matrices by columns or by rows.
#define WHIRL_MATRIX_MATRIX(INSTANTIATE, L, OrderL, ConjugateL, R, OrderR, ConjugateR)                            \
  INSTANTIATE struct internal::general_matrix_matrix_product<Index, L, OrderL, ConjugateL, R, OrderR, ConjugateR, \
                                                             ColMajor, 1>;
// What chooses between the loops for a product of plain matrices or of their transposes.
#define WHIRL_PRODUCT(INSTANTIATE, T, L, R)                                                                  \
  INSTANTIATE void internal::generic_product_impl<L, R, DenseShape, DenseShape, GemmProduct>::scaleAndAddTo( \
      Matrix<T, Dynamic, Dynamic>&, const L&, const R&, const T&);

#define WHIRL_PRODUCTS_REAL(INSTANTIATE)                                                                              \
  WHIRL_KERNEL(INSTANTIATE, double, double, false, false)                                                             \
  WHIRL_PACK(INSTANTIATE, double)                                                                                     \
  WHIRL_BLOCKING(INSTANTIATE, double, double)                                                                         \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, double, ColMajor, false, double, ColMajor, false)                                  \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, double, RowMajor, false, double, ColMajor, false)                                  \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, double, ColMajor, false, double, RowMajor, false)                                  \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, double, RowMajor, false, double, RowMajor, false)                                  \
  WHIRL_PRODUCT(INSTANTIATE, double, MatrixXd, MatrixXd)                                                              \
  WHIRL_PRODUCT(INSTANTIATE, double, Transpose<MatrixXd>, MatrixXd)                                                   \
  WHIRL_PRODUCT(INSTANTIATE, double, Transpose<const MatrixXd>, MatrixXd)                                             \
  WHIRL_PRODUCT(INSTANTIATE, double, MatrixXd, Transpose<MatrixXd>)                                                   \
  WHIRL_PRODUCT(INSTANTIATE, double, MatrixXd, Transpose<const MatrixXd>)                                             \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, ColMajor, false, double, RowMajor, false, 0)                               \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, ColMajor, false, double, ColMajor, false, 0)                               \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, RowMajor, false, double, ColMajor, false, 0)                               \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, RowMajor, false, double, RowMajor, false, 1)                               \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheLeft, Lower, false, ColMajor)                                        \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheLeft, Upper, false, ColMajor)                                        \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheLeft, Upper, false, RowMajor)                                        \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheLeft, UnitLower, false, ColMajor)                                    \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheLeft, UnitUpper, false, RowMajor)                                    \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, double, OnTheRight, Upper, false, RowMajor)                                       \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, double, Lower, false, ColMajor)                                                 \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, double, Upper, false, RowMajor)                                                 \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, double, UnitLower, false, ColMajor)                                             \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, double, UnitUpper, false, RowMajor)                                             \
  INSTANTIATE struct internal::triangular_solve_vector<double, double, Index, OnTheLeft, Upper, false, ColMajor>;     \
  INSTANTIATE struct internal::triangular_solve_vector<double, double, Index, OnTheLeft, UnitLower, false, ColMajor>; \
  INSTANTIATE struct internal::triangular_matrix_vector_product<Index, UnitUpper, double, false, double, false,       \
                                                                RowMajor>;                                            \
  INSTANTIATE struct internal::selfadjoint_matrix_vector_product<double, Index, ColMajor, Lower, false, false>;

#define WHIRL_ADJOINT \
  CwiseUnaryOp<internal::scalar_conjugate_op<std::complex<double>>, const Transpose<const MatrixXcd>>
#define WHIRL_PRODUCTS_COMPLEX(INSTANTIATE)                                                                           \
  WHIRL_KERNEL(INSTANTIATE, std::complex<double>, std::complex<double>, false, false)                                 \
  WHIRL_KERNEL(INSTANTIATE, std::complex<double>, std::complex<double>, true, false)                                  \
  WHIRL_KERNEL(INSTANTIATE, std::complex<double>, std::complex<double>, false, true)                                  \
  WHIRL_PACK(INSTANTIATE, std::complex<double>)                                                                       \
  WHIRL_BLOCKING(INSTANTIATE, std::complex<double>, std::complex<double>)                                             \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, std::complex<double>, ColMajor, false, std::complex<double>, ColMajor, false)      \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, std::complex<double>, RowMajor, true, std::complex<double>, ColMajor, false)       \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, std::complex<double>, RowMajor, false, std::complex<double>, ColMajor, false)      \
  WHIRL_MATRIX_MATRIX(INSTANTIATE, std::complex<double>, ColMajor, false, std::complex<double>, RowMajor, true)       \
  WHIRL_PRODUCT(INSTANTIATE, std::complex<double>, MatrixXcd, MatrixXcd)                                              \
  WHIRL_PRODUCT(INSTANTIATE, std::complex<double>, WHIRL_ADJOINT, MatrixXcd)                                          \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, ColMajor, false, std::complex<double>, RowMajor, false, 0)   \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, ColMajor, false, std::complex<double>, RowMajor, true, 0)    \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, ColMajor, false, std::complex<double>, ColMajor, false, 0)   \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, false, std::complex<double>, ColMajor, false, 0)   \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, false, std::complex<double>, ColMajor, true, 0)    \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, true, std::complex<double>, ColMajor, false, 0)    \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, false, std::complex<double>, RowMajor, false, 1)   \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, false, std::complex<double>, RowMajor, true, 1)    \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, std::complex<double>, OnTheLeft, Lower, false, ColMajor)                          \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, std::complex<double>, OnTheLeft, Upper, false, ColMajor)                          \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, std::complex<double>, OnTheLeft, Upper, true, RowMajor)                           \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, std::complex<double>, OnTheLeft, UnitLower, false, ColMajor)                      \
  WHIRL_TRIANGLE_SOLVE(INSTANTIATE, std::complex<double>, OnTheRight, Upper, true, RowMajor)                          \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, std::complex<double>, Lower, true, ColMajor)                                    \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, std::complex<double>, Upper, false, RowMajor)                                   \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, std::complex<double>, UnitLower, false, ColMajor)                               \
  WHIRL_TRIANGLE_PRODUCT(INSTANTIATE, std::complex<double>, UnitUpper, true, RowMajor)                                \
  INSTANTIATE struct internal::triangular_matrix_vector_product<Index, UnitUpper, std::complex<double>, false,        \
                                                                std::complex<double>, true, RowMajor>;                \
  INSTANTIATE struct internal::selfadjoint_matrix_vector_product<std::complex<double>, Index, ColMajor, Lower, false, \
                                                                 false>;

#define WHIRL_PRODUCTS_MIXED(INSTANTIATE)                                                             \
  WHIRL_KERNEL(INSTANTIATE, double, std::complex<double>, false, false)                               \
  WHIRL_KERNEL(INSTANTIATE, std::complex<double>, double, false, false)                               \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, RowMajor, false, std::complex<double>, ColMajor, false, 0) \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, double, ColMajor, false, std::complex<double>, RowMajor, false, 0) \
  WHIRL_MATRIX_VECTOR(INSTANTIATE, std::complex<double>, RowMajor, false, double, ColMajor, false, 0)

namespace Eigen {

WHIRL_PRODUCTS_REAL(extern template)
WHIRL_PRODUCTS_COMPLEX(extern template)
WHIRL_PRODUCTS_MIXED(extern template)

}  // namespace Eigen
