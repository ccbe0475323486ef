#pragma once
#include <Eigen/Core>

namespace whirl::modal {

/// Samples of one period of a signal that repeats itself at least once in the record, to 2 % of its power; 0 where it
/// does not, or not after a whole number of samples.
Eigen::Index period_of(const Eigen::Ref<const Eigen::VectorXd>& signal);

}  // namespace whirl::modal
