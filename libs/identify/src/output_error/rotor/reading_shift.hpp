#pragma once
#include <Eigen/Core>

/// A sampled motion read between its samples, by polynomials of degree five through six of them. Below a quarter of the
/// sampling rate the error is below 1e-3 of the motion, below a tenth below 1e-5.
namespace whirl::identification::detail {

/// y at i + samples, for every i. At the ends the nearest six samples are continued.
Eigen::VectorXd later(const Eigen::VectorXd& y, double samples);
/// Its derivative by `samples`.
Eigen::VectorXd later_rate(const Eigen::VectorXd& y, double samples);

}  // namespace whirl::identification::detail
