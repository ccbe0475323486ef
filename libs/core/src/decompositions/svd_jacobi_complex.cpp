#include "whirl/core/decompositions.hpp"

namespace Eigen {

template class JacobiSVD<MatrixXcd>;

}  // namespace Eigen
