#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_EIGENSOLVER(template, SelfAdjointEigenSolver, MatrixXcd, int)
WHIRL_EIGENSOLVER(template, ComplexEigenSolver, MatrixXcd, bool)
WHIRL_EIGENSOLVER(template, ComplexSchur, MatrixXcd, bool)

}  // namespace Eigen
