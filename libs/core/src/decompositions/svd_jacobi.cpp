#include "whirl/core/decompositions.hpp"

namespace Eigen {

template class JacobiSVD<MatrixXd>;

}  // namespace Eigen
