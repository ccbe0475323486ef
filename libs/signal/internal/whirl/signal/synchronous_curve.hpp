#pragma once
#include <Eigen/Core>
#include <string>

#include "whirl/core/quantity.hpp"

namespace whirl::signal {

/// The synchronous vector of a run: x(t) = Re(Z exp(j order beta)), amplitude peak.
struct SynchronousCurve {
  std::string name;
  Eigen::VectorXd speed;      ///< rad/s
  Eigen::VectorXcd vector;    ///< SI unit of `quantity`, peak; positive phase leads the mark
  Eigen::VectorXd time = {};  ///< s, middle of the turns of each vector; empty when unknown (a table of speeds)
  Quantity quantity = Quantity::displacement;
  double order = 1;
};

}  // namespace whirl::signal
