#include "influence_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/decompositions.hpp"

namespace whirl::diagnosis {

using Eigen::Index;

RunDesign::RunDesign(const BalancingJob& job, bool drift) : with_drift(drift) {
  reference = job.runs.front().time;
  for (const BalancingRun& run : job.runs) reference = std::max(reference, run.time);
}

Eigen::RowVectorXcd RunDesign::row(const BalancingRun& run, const Eigen::VectorXcd& masses) const {
  Eigen::RowVectorXcd x(first_plane() + masses.size());
  x[0] = 1;
  if (with_drift) x[1] = run.time - reference;
  x.tail(masses.size()) = masses.transpose();
  return x;
}

Eigen::MatrixXcd RunDesign::rows_of(const BalancingJob& job, Index m, const std::vector<bool>& used) const {
  Eigen::MatrixXcd x(static_cast<Index>(job.runs.size()), first_plane() + static_cast<Index>(job.planes.size()));
  Index n = 0;
  for (std::size_t r = 0; r < job.runs.size(); ++r)
    if (used[r] && !std::isnan(std::abs(job.runs[r].vibration[m]))) x.row(n++) = row(job.runs[r]);
  return x.topRows(n);
}

InfluenceFit solve_runs(const BalancingJob& job, const RunDesign& design, const std::vector<bool>& used, double noise) {
  const auto rows = static_cast<Index>(job.rows.size()), planes = static_cast<Index>(job.planes.size());
  InfluenceFit fit;
  fit.with_drift = design.with_drift;
  fit.speed = job.speed.empty() ? std::vector<int>(job.rows.size(), 0) : job.speed;
  fit.influence.resize(rows, planes);
  fit.baseline.resize(rows);
  fit.drift = Eigen::VectorXcd::Zero(rows);
  const int speeds = 1 + *std::max_element(fit.speed.begin(), fit.speed.end());
  Eigen::VectorXd square = Eigen::VectorXd::Zero(speeds), freedom = Eigen::VectorXd::Zero(speeds);
  for (Index m = 0; m < rows; ++m) {
    const Eigen::MatrixXcd x = design.rows_of(job, m, used);
    Eigen::VectorXcd y(x.rows());
    Index n = 0;
    for (std::size_t r = 0; r < job.runs.size(); ++r)
      if (used[r] && !std::isnan(std::abs(job.runs[r].vibration[m]))) y[n++] = job.runs[r].vibration[m];
    // Columns of very different size (grams, hours): scaled to norm 1.
    Eigen::VectorXd scale = x.colwise().norm().transpose().real();
    for (Index k = 0; k < scale.size(); ++k) scale[k] = scale[k] > 0 ? 1 / scale[k] : 1;
    const Eigen::MatrixXcd z = x * scale.asDiagonal();
    const Eigen::VectorXcd beta = scale.asDiagonal() * z.colPivHouseholderQr().solve(y);
    const Eigen::MatrixXcd gram = z.adjoint() * z;
    const Eigen::MatrixXcd inverse = gram.ldlt().solve(Eigen::MatrixXcd::Identity(x.cols(), x.cols()));
    fit.cofactor.emplace_back(scale.asDiagonal() * inverse * scale.asDiagonal());
    fit.baseline[m] = beta[0];
    if (design.with_drift) fit.drift[m] = beta[1];
    fit.influence.row(m) = beta.tail(planes).transpose();
    const int s = fit.speed[static_cast<std::size_t>(m)];
    if (x.rows() > x.cols()) {
      square[s] += (y - x * beta).squaredNorm();
      freedom[s] += 2.0 * static_cast<double>(x.rows() - x.cols());
    }
  }
  fit.noise.resize(rows);
  fit.freedom.resize(rows);
  for (Index m = 0; m < rows; ++m) {
    const int s = fit.speed[static_cast<std::size_t>(m)];
    fit.noise[m] = noise > 0        ? noise
                   : freedom[s] > 0 ? std::sqrt(square[s] / freedom[s])
                                    : std::numeric_limits<double>::quiet_NaN();
    fit.freedom[m] = noise > 0 ? std::numeric_limits<double>::infinity() : freedom[s];
  }
  return fit;
}

}  // namespace whirl::diagnosis
