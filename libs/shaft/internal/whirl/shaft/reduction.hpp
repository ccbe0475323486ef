#pragma once
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

struct ReductionOptions {
  int modes = 8;              ///< of a plane, those of lowest frequency
  bool static_shapes = true;  ///< beside them the deflection under each support's force, the unbalance and the bow
  double highest = 0;         ///< the error is looked at up to this speed, rad/s; 0: the third of the modes kept
  int speeds = 40;
};

/// A model of few coordinates: modes of the plane at rest, with the supports' mean direct stiffness, and static shapes
/// (residual flexibility; Craig and Kurdila, Fundamentals of Structural Dynamics, 2006, sec. 17.6). Its supports keep
/// their laws, its equations are those of System, so whatever takes a system takes this one.
struct Reduction {
  System system;
  Eigen::MatrixXd basis;            ///< coordinates of the full model from those of `system`
  std::vector<double> frequencies;  ///< of its coordinates, rad/s
  /// Unbalance response against the full model: largest difference over the stations, as a part of the largest
  /// deflection at that speed, at the speeds looked at. Each speed is one at which the error is seen, not a bound
  /// between them.
  double worst_error = 0;
  double worst_speed = 0;  ///< where, rad/s
  std::vector<double> speeds, errors;
};
/// Throws Error for fewer than one mode. Where the rotor has no unbalance, one at every disc and support is looked at.
Reduction reduce(const System& system, const ReductionOptions& options = {});
/// The system in coordinates p of q = basis p.
System project(const System& system, const Eigen::MatrixXd& basis);

}  // namespace whirl::shaft
