#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_EIGENSOLVER(template, SelfAdjointEigenSolver, MatrixXd, int)

}  // namespace Eigen
