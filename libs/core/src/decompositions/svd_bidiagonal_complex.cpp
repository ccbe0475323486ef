#include "whirl/core/decompositions.hpp"

namespace Eigen {

template class internal::UpperBidiagonalization<MatrixXcd>;

}  // namespace Eigen
