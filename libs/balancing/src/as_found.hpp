#pragma once
#include <Eigen/Core>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::balancing {

/// Size of the mean vector of the runs without any mass, by reading, in the unit of the job; NaN where there is none.
Eigen::VectorXd measured_as_found(const diagnosis::BalancingJob& job);

}  // namespace whirl::balancing
