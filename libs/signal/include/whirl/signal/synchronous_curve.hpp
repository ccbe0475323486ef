#pragma once
#include <Eigen/Core>
#include <string>

namespace whirl::signal {

/// The synchronous vector of a run: x(t) = Re(Z exp(j beta)), amplitude peak.
struct SynchronousCurve {
  std::string name;
  Eigen::VectorXd speed;      ///< rad/s
  Eigen::VectorXcd vector;    ///< m peak; positive phase leads the mark
  Eigen::VectorXd time = {};  ///< s, middle of the turns of each vector; empty when unknown (a table of speeds)
};

}  // namespace whirl::signal
