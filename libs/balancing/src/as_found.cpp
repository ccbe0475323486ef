#include "as_found.hpp"

#include <cmath>

namespace whirl::balancing {

Eigen::VectorXd measured_as_found(const diagnosis::BalancingJob& job) {
  const auto rows = static_cast<Eigen::Index>(job.rows.size());
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(rows);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(rows);
  for (const diagnosis::BalancingRun& run : job.runs) {
    if (run.masses.norm() > 0) continue;
    for (Eigen::Index m = 0; m < rows; ++m) {
      // Without phases the imaginary part tells nothing but that the reading is missing.
      if (std::isnan(std::abs(run.vibration[m]))) continue;
      sum[m] += run.vibration[m];
      count[m] += 1;
    }
  }
  return sum.cwiseAbs().cwiseQuotient(count);  // NaN where there is none
}

}  // namespace whirl::balancing
