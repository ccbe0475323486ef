#include "whirl/core/decompositions.hpp"

namespace Eigen {

template BDCSVD<MatrixXcd>& BDCSVD<MatrixXcd>::compute(const MatrixXcd&, unsigned);

}  // namespace Eigen
