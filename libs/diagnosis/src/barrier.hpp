#pragma once
#include <Eigen/Core>

namespace whirl::diagnosis {

struct BarrierResult {
  Eigen::VectorXcd masses;
  double bound = 0;  ///< lower bound of the objective from a dual point
};

/// min t with |v + A w| <= t (each row on its own when `rowwise`, else the whole vector) and |w_p| <= limit_p
/// (infinity: none).
BarrierResult minimise_cones(const Eigen::MatrixXcd& a, const Eigen::VectorXcd& v, const Eigen::VectorXd& limit,
                             bool rowwise);

}  // namespace whirl::diagnosis
