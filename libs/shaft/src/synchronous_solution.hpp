#pragma once
#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// Coordinates (q_x, q_y) of the steady response Re(q e^{i theta}) at a speed, of size 2 system.size().
Eigen::VectorXcd synchronous_solution(const System& system, double speed);

}  // namespace whirl::shaft
