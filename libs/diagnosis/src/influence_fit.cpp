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

bool RunDesign::told_by(const BalancingJob& job, const std::vector<bool>& used) const {
  for (std::size_t m = 0; m < job.rows.size(); ++m) {
    const Eigen::MatrixXcd x = rows_of(job, static_cast<Index>(m), used);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> qr(x);
    qr.setThreshold(1e-6);
    if (x.rows() < x.cols() || qr.rank() < x.cols()) return false;
  }
  return true;
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
  const auto runs = static_cast<Index>(job.runs.size());
  Eigen::MatrixXcd residual = Eigen::MatrixXcd::Zero(runs, rows);
  Eigen::VectorXd spare(rows);
  Eigen::VectorXd square = Eigen::VectorXd::Zero(speeds), freedom = Eigen::VectorXd::Zero(speeds);
  for (Index m = 0; m < rows; ++m) {
    const Eigen::MatrixXcd x = design.rows_of(job, m, used);
    std::vector<Index> read;
    for (std::size_t r = 0; r < job.runs.size(); ++r)
      if (used[r] && !std::isnan(std::abs(job.runs[r].vibration[m]))) read.push_back(static_cast<Index>(r));
    Eigen::VectorXcd y(x.rows());
    for (Index k = 0; k < y.size(); ++k)
      y[k] = job.runs[static_cast<std::size_t>(read[static_cast<std::size_t>(k)])].vibration[m];
    // Columns of very different size (grams, hours): scaled to norm 1.
    Eigen::VectorXd scale = x.colwise().norm().transpose().real();
    for (Index k = 0; k < scale.size(); ++k) scale[k] = scale[k] > 0 ? 1 / scale[k] : 1;
    const Eigen::MatrixXcd z = x * scale.asDiagonal();
    const Eigen::VectorXcd beta = scale.asDiagonal() * z.colPivHouseholderQr().solve(y);
    const Eigen::MatrixXcd gram = z.adjoint() * z;
    const Eigen::MatrixXcd inverse = gram.ldlt().solve(Eigen::MatrixXcd::Identity(x.cols(), x.cols()));
    fit.cofactor.emplace_back(scale.asDiagonal() * inverse * scale.asDiagonal());
    fit.gain.emplace_back(Eigen::MatrixXcd::Zero(x.cols(), runs));
    const Eigen::MatrixXcd gain = scale.asDiagonal() * inverse * z.adjoint();
    for (Index k = 0; k < y.size(); ++k) fit.gain.back().col(read[static_cast<std::size_t>(k)]) = gain.col(k);
    const Eigen::VectorXcd e = y - x * beta;
    for (Index k = 0; k < e.size(); ++k) residual(read[static_cast<std::size_t>(k)], m) = e[k];
    spare[m] = static_cast<double>(x.rows() - x.cols());
    fit.baseline[m] = beta[0];
    if (design.with_drift) fit.drift[m] = beta[1];
    fit.influence.row(m) = beta.tail(planes).transpose();
    const int s = fit.speed[static_cast<std::size_t>(m)];
    if (x.rows() > x.cols()) {
      square[s] += e.squaredNorm();
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
  fit.used = used;
  fit.scatter = (2 * fit.noise.array().square()).matrix().cast<std::complex<double>>().asDiagonal();
  fit.spare = noise > 0 ? std::numeric_limits<double>::infinity() : 0;
  if (noise > 0) return fit;
  for (const double own : spare)
    if (own > 0 && (fit.spare == 0 || own < fit.spare)) fit.spare = own;
  // A row without a spare run of its own keeps the noise of its speed.
  for (Index m = 0; m < rows; ++m)
    for (Index l = 0; l < rows; ++l)
      if (spare[m] > 0 && spare[l] > 0)
        fit.scatter(m, l) =
            (residual.col(m).array() * residual.col(l).array().conjugate()).sum() / std::sqrt(spare[m] * spare[l]);
  return fit;
}

}  // namespace whirl::diagnosis
