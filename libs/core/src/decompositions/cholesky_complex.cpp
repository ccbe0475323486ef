#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_CHOLESKY(template, LLT, MatrixXcd, VectorXcd)
WHIRL_CHOLESKY(template, LDLT, MatrixXcd, VectorXcd)

}  // namespace Eigen
