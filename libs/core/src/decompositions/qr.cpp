#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_QR(template, HouseholderQR, MatrixXd, VectorXd)
WHIRL_QR(template, ColPivHouseholderQR, MatrixXd, VectorXd)
WHIRL_QR(template, CompleteOrthogonalDecomposition, MatrixXd, VectorXd)

}  // namespace Eigen
