#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_CHOLESKY(template, LLT, MatrixXcd, VectorXcd)

}  // namespace Eigen
