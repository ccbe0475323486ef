#include "whirl/core/decompositions.hpp"

namespace Eigen {

WHIRL_CHOLESKY(template, LLT, MatrixXd, VectorXd)
WHIRL_CHOLESKY(template, LDLT, MatrixXd, VectorXd)

}  // namespace Eigen
