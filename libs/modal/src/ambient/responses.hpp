#pragma once
#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// The responses of the record less their means, one per column; channels that never change are left out with a
/// warning. Throws Error unless there is one and all show one quantity.
Eigen::MatrixXd responses_of(const Recording& recording, OperationalModes& result);

}  // namespace whirl::modal
