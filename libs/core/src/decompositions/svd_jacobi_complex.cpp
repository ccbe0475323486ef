#include "whirl/core/decompositions.hpp"

namespace Eigen {

template JacobiSVD<MatrixXcd>& JacobiSVD<MatrixXcd>::compute(const MatrixXcd&, unsigned);

}  // namespace Eigen
