#include "whirl/core/decompositions.hpp"

namespace Eigen {

template class BDCSVD<MatrixXcd>;

}  // namespace Eigen
