#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_EIGENSOLVER(template, ComplexEigenSolver, MatrixXcd, bool)

}  // namespace Eigen
