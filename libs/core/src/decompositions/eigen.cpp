#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_EIGENSOLVER(template, SelfAdjointEigenSolver, MatrixXd, int)
WHIRL_EIGENSOLVER(template, EigenSolver, MatrixXd, bool)
WHIRL_EIGENSOLVER(template, RealSchur, MatrixXd, bool)

}  // namespace Eigen
