#pragma once
#include <Eigen/Core>
#include <set>
#include <string>
#include <vector>

#include "whirl/identify/identify.hpp"

namespace whirl::identification::detail {

/// One row a . p <= b with what it stands for.
struct BoundRow {
  Eigen::VectorXd a;
  double b;
  std::string text;
};

/// The point nearest to `p0` in the metric of the covariance within all rows (Hildreth's method on the dual);
/// multipliers by row. False when the rows contradict each other.
bool nearest(const Eigen::VectorXd& p0, const Eigen::MatrixXd& covariance, const std::vector<BoundRow>& rows,
             Eigen::VectorXd& p, Eigen::VectorXd& multipliers);

/// What may be called, and how the estimated terms follow from the parameters: one row for every term in the order of
/// the equations, one column for every parameter.
struct Unknowns {
  std::set<std::string> names;
  Eigen::MatrixXd ties;
};
Unknowns unknowns_of(const IdentifyOptions& options, const Recording& like, const IdentifiedModel& model);

/// Puts the parameters, with their covariance, and the coefficients that follow from them into the model.
void write(const Eigen::VectorXd& p, const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& ties,
           IdentifiedModel& model);

}  // namespace whirl::identification::detail
