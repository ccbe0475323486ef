#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace whirl::modal {

/// Whether a force-deflection table follows another law than the cubic one that was fitted to it.
struct LackOfFit {
  std::string law;        ///< what fits better or is seen, e.g. "a term in d^2 fits better (...)"; empty: none
  Eigen::VectorXd shift;  ///< of the parameters when the better term is fitted beside them; else zero
  double widening = 1;    ///< of standard deviations, for residuals that hang together along the deflection
};

/// `x`: deflections of order 1; `weight`: of every residual; `jacobian`: of the law by the parameters, weighted;
/// `offset`: deflection at zero force, in units of x. Two looks, each with a chance of about 1e-3 on a table that
/// follows the law: t tests of d^2, d^5 and sgn d, and the residuals' correlation from one deflection to the next (von
/// Neumann 1941).
LackOfFit lack_of_fit(const Eigen::VectorXd& x, const Eigen::VectorXd& residual, const Eigen::VectorXd& weight,
                      const Eigen::MatrixXd& jacobian, double offset);

/// Points that read exactly the largest (`sign` 1) or smallest force over a stretch of deflections: a load cell at its
/// limit. Empty when there is no such stretch.
std::vector<Eigen::Index> at_limit(const Eigen::VectorXd& x, const Eigen::VectorXd& force, int sign);

}  // namespace whirl::modal
