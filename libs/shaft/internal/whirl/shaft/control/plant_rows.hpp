#pragma once
#include <Eigen/Core>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// Force on the coordinates (q_x, q_y) per newton of each actuator, and what each probe reads of them.
Eigen::MatrixXd actuator_columns(const Rotor& rotor, const System& system);
Eigen::MatrixXd probe_rows(const Rotor& rotor, const System& system);

}  // namespace whirl::shaft
