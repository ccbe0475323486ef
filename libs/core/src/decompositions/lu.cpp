#include "whirl/core/decompositions.hpp"

namespace Eigen {

template void PartialPivLU<MatrixXd>::compute();
template void PartialPivLU<MatrixXcd>::compute();
template PartialPivLU<MatrixXd>::PartialPivLU(const EigenBase<MatrixXd>&);
template PartialPivLU<MatrixXcd>::PartialPivLU(const EigenBase<MatrixXcd>&);

}  // namespace Eigen

namespace whirl {

Eigen::MatrixXd inverse(const Eigen::MatrixXd& a) { return a.inverse(); }

}  // namespace whirl
