#include "whirl/diagnosis/influence_prior.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

/// Baseline and influence as one complex Gaussian: (b, vec A), b flat.
struct Posterior {
  Eigen::VectorXcd mean;
  Eigen::MatrixXcd covariance;
  double chi = 0;      ///< innovation^H covariance^-1 innovation
  double freedom = 0;  ///< complex readings beyond those that the flat baseline takes
};

Posterior condition(const BalancingJob& job, const InfluencePrior& prior, double noise) {
  const auto rows = static_cast<Index>(job.rows.size()), planes = static_cast<Index>(job.planes.size());
  const Index n = rows + rows * planes;
  double level = 0;
  for (const BalancingRun& run : job.runs)
    for (Index m = 0; m < rows; ++m)
      if (!std::isnan(std::abs(run.vibration[m]))) level = std::max(level, std::abs(run.vibration[m]));
  Posterior p;
  p.mean = Eigen::VectorXcd::Zero(n);
  p.mean.tail(rows * planes) = prior.mean.reshaped();
  Eigen::MatrixXcd s = Eigen::MatrixXcd::Zero(n, n);
  s.topLeftCorner(rows, rows) = Eigen::MatrixXcd::Identity(rows, rows) * std::pow(100 * (level + noise), 2);
  s.bottomRightCorner(rows * planes, rows * planes) = prior.covariance;
  std::vector<std::complex<double>> readings;
  std::vector<Eigen::VectorXcd> gains;
  std::vector<bool> seen(static_cast<std::size_t>(rows), false);
  for (const BalancingRun& run : job.runs) {
    for (Index m = 0; m < rows; ++m) {
      if (std::isnan(std::abs(run.vibration[m]))) continue;
      Eigen::VectorXcd h = Eigen::VectorXcd::Zero(n);
      h[m] = 1;
      for (Index q = 0; q < planes; ++q) h[rows + q * rows + m] = run.masses[q];
      gains.push_back(h);
      readings.push_back(run.vibration[m]);
      p.freedom += seen[static_cast<std::size_t>(m)];
      seen[static_cast<std::size_t>(m)] = true;
    }
  }
  const auto k = static_cast<Index>(readings.size());
  Eigen::MatrixXcd h(k, n);
  Eigen::VectorXcd innovation(k);
  for (Index i = 0; i < k; ++i) {
    h.row(i) = gains[static_cast<std::size_t>(i)].transpose();
    innovation[i] = readings[static_cast<std::size_t>(i)] - (h.row(i) * p.mean)(0);
  }
  const Eigen::MatrixXcd cross = s * h.adjoint();
  const Eigen::LDLT<Eigen::MatrixXcd> spread(
      Eigen::MatrixXcd(h * cross + 2 * noise * noise * Eigen::MatrixXcd::Identity(k, k)));
  const Eigen::VectorXcd solved = spread.solve(innovation);
  p.chi = innovation.dot(solved).real();
  p.mean += cross * solved;
  p.covariance = s - cross * spread.solve(Eigen::MatrixXcd(cross.adjoint()));
  p.covariance = (0.5 * (p.covariance + p.covariance.adjoint())).eval();
  return p;
}

Eigen::VectorXcd expected_best(const Posterior& p, Index rows, Index planes) {
  Eigen::MatrixXcd normal = Eigen::MatrixXcd::Zero(planes, planes);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(planes);
  const auto at = [&](Index m, Index q) { return rows + q * rows + m; };
  for (Index m = 0; m < rows; ++m) {
    for (Index q = 0; q < planes; ++q) {
      right[q] += std::conj(p.mean[at(m, q)]) * p.mean[m] + p.covariance(m, at(m, q));
      for (Index r = 0; r < planes; ++r)
        normal(q, r) += std::conj(p.mean[at(m, q)]) * p.mean[at(m, r)] + p.covariance(at(m, r), at(m, q));
    }
  }
  return -normal.ldlt().solve(right);
}

Estimate percentiles(std::vector<double> v, double value) {
  std::sort(v.begin(), v.end());
  const auto at = [&](double part) {
    return v[static_cast<std::size_t>(part * static_cast<double>(v.size() - 1) + 0.5)];
  };
  double mean = 0, square = 0;
  for (const double x : v) mean += x / static_cast<double>(v.size());
  for (const double x : v) square += (x - mean) * (x - mean) / static_cast<double>(v.size() - 1);
  return {value, std::sqrt(square), at(0.025), at(0.975)};
}

/// Angle of z turned so that `about` is zero.
double turned(std::complex<double> z, std::complex<double> about) { return std::arg(z * std::conj(about)); }

}  // namespace

void InfluencePrior::check(Index rows, Index planes) const {
  if (mean.rows() != rows || mean.cols() != planes)
    throw Error(fmt::format("prior: {} x {} influence coefficients for {} readings and {} planes", mean.rows(),
                            mean.cols(), rows, planes));
  if (covariance.rows() != rows * planes || covariance.cols() != rows * planes)
    throw Error(fmt::format("prior: covariance of {} for {} coefficients", covariance.rows(), rows * planes));
  if (!mean.allFinite() || !covariance.allFinite()) throw Error("prior: an influence coefficient is not finite");
}

InfluencePrior relative_prior(const Eigen::MatrixXcd& mean, double common, double each, const std::vector<int>& speed) {
  require_range("common error", common, 0, 100);
  require_range("error of each coefficient", each, 0, 100);
  if (!speed.empty() && static_cast<Index>(speed.size()) != mean.rows())
    throw Error("prior: one speed a row is needed");
  InfluencePrior prior;
  prior.mean = mean;
  const Eigen::VectorXcd a = mean.reshaped();
  prior.covariance = Eigen::MatrixXcd::Zero(a.size(), a.size());
  const auto at = [&](Index i) { return speed.empty() ? 0 : speed[static_cast<std::size_t>(i % mean.rows())]; };
  for (Index i = 0; i < a.size(); ++i) {
    for (Index j = 0; j < a.size(); ++j)
      if (at(i) == at(j)) prior.covariance(i, j) = common * common * a[i] * std::conj(a[j]);
    prior.covariance(i, i) += each * each * std::norm(a[i]);
  }
  return prior;
}

InfluencePrior ensemble_prior(const std::vector<Eigen::MatrixXcd>& models, double floor) {
  require_range("floor", floor, 0, 10);
  if (models.size() < 2) throw Error("prior: at least two models are needed");
  InfluencePrior prior;
  prior.mean = Eigen::MatrixXcd::Zero(models[0].rows(), models[0].cols());
  for (const Eigen::MatrixXcd& m : models) {
    if (m.rows() != prior.mean.rows() || m.cols() != prior.mean.cols()) throw Error("prior: models of different size");
    prior.mean += m / static_cast<double>(models.size());
  }
  Eigen::MatrixXcd apart(prior.mean.size(), static_cast<Index>(models.size()));
  for (std::size_t k = 0; k < models.size(); ++k)
    apart.col(static_cast<Index>(k)) = (models[k] - prior.mean).reshaped();
  prior.covariance = apart * apart.adjoint() / static_cast<double>(models.size() - 1);
  for (Index i = 0; i < prior.mean.size(); ++i)
    prior.covariance(i, i) += floor * floor * (std::norm(prior.mean.reshaped()[i]) + prior.covariance(i, i).real());
  return prior;
}

BayesianBalance balance_with_prior(const BalancingJob& job, const InfluencePrior& prior, double noise, int draws,
                                   unsigned seed) {
  job.check();
  const auto rows = static_cast<Index>(job.rows.size()), planes = static_cast<Index>(job.planes.size());
  prior.check(rows, planes);
  require_range("noise", noise, 1e-15, 1e3, "m");
  require_range("draws", draws, 100, 1e6);
  for (Index m = 0; m < rows; ++m)
    if (std::all_of(job.runs.begin(), job.runs.end(),
                    [&](const BalancingRun& run) { return std::isnan(std::abs(run.vibration[m])); }))
      throw Error(fmt::format("{}: no run has a reading", job.rows[static_cast<std::size_t>(m)]));
  const Posterior posterior = condition(job, prior, noise);
  BayesianBalance b;
  b.baseline = posterior.mean.head(rows);
  b.influence = posterior.mean.tail(rows * planes).reshaped(rows, planes);
  b.influence_sd =
      (0.5 * posterior.covariance.diagonal().real().tail(rows * planes).cwiseMax(0)).cwiseSqrt().reshaped(rows, planes);
  b.masses = expected_best(posterior, rows, planes);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> spread(posterior.covariance);
  const Eigen::MatrixXcd root =
      spread.eigenvectors() * spread.eigenvalues().cwiseMax(0).cwiseSqrt().cast<std::complex<double>>().asDiagonal();
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, std::numbers::sqrt2 / 2);
  std::vector<std::vector<double>> parts(static_cast<std::size_t>(4 * planes)),
      residual(static_cast<std::size_t>(rows));
  for (int d = 0; d < draws; ++d) {
    Eigen::VectorXcd white(root.cols());
    for (Index k = 0; k < white.size(); ++k) white[k] = {normal(random), normal(random)};
    const Eigen::VectorXcd theta = posterior.mean + root * white;
    const Eigen::MatrixXcd a = theta.tail(rows * planes).reshaped(rows, planes);
    const Eigen::VectorXcd w = -a.completeOrthogonalDecomposition().solve(theta.head(rows));
    for (Index p = 0; p < planes; ++p) {
      const auto at = static_cast<std::size_t>(4 * p);
      parts[at].push_back(w[p].real());
      parts[at + 1].push_back(w[p].imag());
      parts[at + 2].push_back(std::abs(w[p]));
      parts[at + 3].push_back(turned(w[p], b.masses[p]));
    }
    const Eigen::VectorXcd left = theta.head(rows) + a * b.masses;
    for (Index m = 0; m < rows; ++m) residual[static_cast<std::size_t>(m)].push_back(std::abs(left[m]));
  }
  for (Index p = 0; p < planes; ++p) {
    const auto at = static_cast<std::size_t>(4 * p);
    b.real.push_back(percentiles(parts[at], b.masses[p].real()));
    b.imag.push_back(percentiles(parts[at + 1], b.masses[p].imag()));
    b.magnitude.push_back(percentiles(parts[at + 2], std::abs(b.masses[p])));
    Estimate angle = percentiles(parts[at + 3], 0);
    const double value = std::arg(b.masses[p]);
    b.angle.push_back({value, angle.sd, value + angle.low, value + angle.high});
  }
  // The median: the residual of the means alone would be far too small.
  for (std::vector<double>& r : residual) {
    std::nth_element(r.begin(), r.begin() + static_cast<long>(r.size() / 2), r.end());
    const double median = r[r.size() / 2];
    b.residual.push_back(percentiles(r, median));
  }
  b.surprise = posterior.freedom > 0 ? posterior.chi / posterior.freedom : std::nan("");
  if (posterior.freedom > 0) {
    if (chi_squared_tail(2 * posterior.freedom, 2 * posterior.chi) < 1e-3)
      b.summary.warn(fmt::format(
          "the runs lie {:.1f} times farther from the prior than its uncertainty allows: give it more, or balance "
          "without it",
          std::sqrt(b.surprise)));
  }
  return b;
}

}  // namespace whirl::diagnosis
