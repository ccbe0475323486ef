#pragma once
#include <Eigen/Core>

namespace whirl {

/// Rotor angle beta(t) with its rate and acceleration, on a grid of half the sample time: entry 2 i is sample i of the
/// record, entry 2 i + 1 the true midpoint that a Runge-Kutta step over one sample needs. Size 2 N - 1 for N samples.
struct AngleSignal {
  double dt = 0;          ///< sample time of the record, s (entries are dt/2 apart)
  Eigen::VectorXd beta;   ///< rad, continuous (not wrapped)
  Eigen::VectorXd omega;  ///< rad/s
  Eigen::VectorXd alpha;  ///< rad/s^2

  Eigen::Index samples() const { return (beta.size() + 1) / 2; }
};

}  // namespace whirl
