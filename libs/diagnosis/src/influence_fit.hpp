#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// What the runs say of the unknowns of each row: columns (1, [time - reference,] masses).
struct RunDesign {
  RunDesign(const BalancingJob& job, bool with_drift);
  Eigen::Index first_plane() const { return with_drift ? 2 : 1; }
  Eigen::RowVectorXcd row(const BalancingRun& run) const { return row(run, run.masses); }
  Eigen::RowVectorXcd row(const BalancingRun& run, const Eigen::VectorXcd& masses) const;
  /// Rows of the runs in `used` that read row m.
  Eigen::MatrixXcd rows_of(const BalancingJob& job, Eigen::Index m, const std::vector<bool>& used) const;

  /// Whether these runs tell every unknown of every row.
  bool told_by(const BalancingJob& job, const std::vector<bool>& used) const;

  bool with_drift = false;
  double reference = 0;  ///< time of the last run
};

/// Least squares of every row; noise pooled over the rows of a speed, or `noise` when > 0.
InfluenceFit solve_runs(const BalancingJob& job, const RunDesign& design, const std::vector<bool>& used, double noise);

/// Radius of the 95 % circle (Hotelling, two dimensions) about a vector whose sd per component is 1, known with so many
/// degrees of freedom; NaN where they are none.
double circle_radius(double freedom);

}  // namespace whirl::diagnosis
