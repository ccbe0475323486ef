#include "whirl/core/decompositions.hpp"

namespace Eigen {

template JacobiSVD<MatrixXd>& JacobiSVD<MatrixXd>::compute(const MatrixXd&, unsigned);

}  // namespace Eigen
