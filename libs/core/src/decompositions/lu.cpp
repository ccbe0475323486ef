#include "whirl/core/decompositions.hpp"

namespace Eigen {

template void PartialPivLU<MatrixXd>::compute();
template void PartialPivLU<MatrixXcd>::compute();

}  // namespace Eigen

namespace whirl {

Eigen::MatrixXd inverse(const Eigen::MatrixXd& a) { return a.inverse(); }

}  // namespace whirl
