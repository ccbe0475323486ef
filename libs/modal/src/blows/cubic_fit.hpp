#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::modal {

/// f = K1 (x - d0) + K2 (x - d0)^3 where both columns may be noisy (orthogonal distance regression with the noise of
/// x known relative to that of f; Boggs, Byrd, Schnabel, 1987). With no noise of x: least squares on f. Gauss-Newton
/// with halved steps by QR, not `descend`: the normal equations of x and x^3 lose half the digits, and the weights move
/// with the law, so that the Jacobian is no exact slope of the cost.
struct CubicFit {
  Eigen::Vector3d p;         ///< K1, K2, d0; d0 = 0 with two parameters
  Eigen::MatrixXd jacobian;  ///< points x parameters, weighted
  Eigen::VectorXd residual;  ///< f - law at the true x, carried back to the measured x: unit of f
  Eigen::VectorXd weight;    ///< 1 / sd of a residual, relative to the noise of f
  double cost = 0;           ///< weighted squares
  double likelihood = 0;     ///< -2 log likelihood, up to a constant
  bool converged = false;

  double freedom() const { return static_cast<double>(residual.size() - jacobian.cols()); }
};

/// `ratio`: noise of x over noise of f, in units of x per unit of f; 0 = x is exact.
CubicFit fit_cubic(const Eigen::VectorXd& x, const Eigen::VectorXd& f, Eigen::Index parameters, double ratio);

/// Points that belong to no such law: those that a fit on all others misses by a t value whose chance, over all points,
/// is below `chance`. The start is a fit of least absolute residuals, so that one wild point cannot hide itself.
std::vector<Eigen::Index> outliers_of(const Eigen::VectorXd& x, const Eigen::VectorXd& f, Eigen::Index parameters,
                                      double chance);

}  // namespace whirl::modal
