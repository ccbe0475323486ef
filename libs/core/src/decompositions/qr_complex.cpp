#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_QR(template, HouseholderQR, MatrixXcd, VectorXcd)
WHIRL_QR(template, ColPivHouseholderQR, MatrixXcd, VectorXcd)
WHIRL_QR(template, CompleteOrthogonalDecomposition, MatrixXcd, VectorXcd)

}  // namespace Eigen
