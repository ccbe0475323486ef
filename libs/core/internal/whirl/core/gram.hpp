#pragma once
#include <Eigen/Core>

namespace whirl {

/// Adds columns^T columns to the lower half of `sum` (p x p), for `columns` n x p with few and long columns. For 1 to
/// 35 columns 1.1 to 4 times as fast as a rank update of Eigen, which is made for large matrices and, in a program for
/// every processor, for the oldest one.
void add_gram(const Eigen::Ref<const Eigen::MatrixXd>& columns, Eigen::MatrixXd& sum);

}  // namespace whirl
