#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_SOLVER(template, HouseholderQR, MatrixXd, VectorXd)
WHIRL_SOLVER(template, ColPivHouseholderQR, MatrixXd, VectorXd)
WHIRL_SOLVER(template, CompleteOrthogonalDecomposition, MatrixXd, VectorXd)

}  // namespace Eigen
