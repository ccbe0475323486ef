#include "centrifuge/load_posterior.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "whirl/core/angles.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr int kSamplesOfDraw = 40;

/// Least squares of one machine: imbalance, and a runout vector of each displacement probe.
struct MachineFit {
  std::complex<double> imbalance;
  double variance = 0;  ///< of each part of it, for noise of the weights
  double squares = 0;   ///< of the residual
  double log_det = 0;
  Index freedom = 0;  ///< real equations less unknowns
  MatrixXcd residuals;
};

MachineFit fit_machine(const MatrixXcd& readings, const LoadRecord& record,
                       const std::vector<CentrifugeSensor>& sensors) {
  const Index count = readings.rows(), blocks = readings.cols();
  std::vector<Index> runout(sensors.size(), -1);
  Index unknowns = 1;
  for (std::size_t s = 0; s < sensors.size(); ++s)
    if (!sensors[s].accelerometer) runout[s] = unknowns++;
  MatrixXcd rows = MatrixXcd::Zero(count * blocks, unknowns);
  VectorXcd values(count * blocks);
  for (Index b = 0; b < blocks; ++b)
    for (Index s = 0; s < count; ++s) {
      const double w = record.weights(s, b);
      rows(b * count + s, 0) = w * readings(s, b);
      if (const Index at = runout[static_cast<std::size_t>(s)]; at >= 0) rows(b * count + s, at) = w;
      values[b * count + s] = w * record.vectors(s, b);
    }
  // In columns of unit length.
  const VectorXd length = rows.colwise().norm().transpose();
  for (Index k = 0; k < unknowns; ++k) rows.col(k) /= length[k];
  const Eigen::LLT<MatrixXcd> normal(MatrixXcd(rows.adjoint() * rows));
  const VectorXcd solution = normal.solve(rows.adjoint() * values);
  const VectorXcd residual = values - rows * solution;
  MachineFit fit;
  fit.imbalance = solution[0] / length[0];
  fit.variance = VectorXcd(normal.solve(VectorXcd::Unit(unknowns, 0)))[0].real() / (length[0] * length[0]);
  fit.squares = residual.squaredNorm();
  fit.log_det = 2 * MatrixXcd(normal.matrixL()).diagonal().real().array().log().sum() + 2 * length.array().log().sum();
  fit.freedom = 2 * (count * blocks - unknowns);
  fit.residuals = residual.reshaped(count, blocks);
  return fit;
}

/// The shortest window of sorted values that holds `part` of the weight.
std::pair<double, double> shortest_window(const std::vector<std::pair<double, double>>& sorted, double part) {
  std::size_t end = 0;
  double held = 0, best = std::numeric_limits<double>::infinity();
  std::pair<double, double> window;
  for (std::size_t begin = 0; begin < sorted.size(); ++begin) {
    while (end < sorted.size() && held < part) held += sorted[end++].second;
    if (held < part) break;
    const double width = sorted[end - 1].first - sorted[begin].first;
    if (width < best) {
      best = width;
      window = {sorted[begin].first, sorted[end - 1].first};
    }
    held -= sorted[begin].second;
  }
  return window;
}

std::vector<std::pair<double, double>> sorted_pairs(const VectorXd& values, const VectorXd& weights) {
  std::vector<std::pair<double, double>> list;
  for (Index k = 0; k < values.size(); ++k) list.emplace_back(values[k], weights[k]);
  std::ranges::sort(list);
  return list;
}

double weighted_median(const std::vector<std::pair<double, double>>& sorted) {
  double held = 0;
  for (const auto& [value, weight] : sorted)
    if ((held += weight) >= 0.5) return value;
  return sorted.back().first;
}

/// Shares of the machines by their scores. Where the record is so sharp that it would rest on a few machines, by chance
/// the nearest ones drawn, its evidence is weakened until enough of them carry the answer.
VectorXd shares_of(const VectorXd& scores) {
  constexpr double kLeast = 30;
  const VectorXd evidence = scores.array() - scores.maxCoeff();
  for (double power = 1;; power *= 0.8) {
    const VectorXd share = (power * evidence.array()).exp().matrix() / (power * evidence.array()).exp().sum();
    if (1 / share.squaredNorm() >= std::min(kLeast, 0.25 * static_cast<double>(scores.size()))) return share;
  }
}

}  // namespace

LoadSamples sample_load(const CentrifugeModel& model, const CentrifugeSetup& setup, const LoadRecord& record, int draws,
                        unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<MachineFit> fits;
  VectorXd scores(draws);
  Index best = 0;
  LoadSamples samples;
  for (Index d = 0; d < draws; ++d) {
    const MatrixXcd readings =
        model.readings(draw_centrifuge(setup, model.sensors().size(), random), record.speeds, record.rates);
    fits.push_back(fit_machine(readings, record, model.sensors()));
    const MachineFit& f = fits.back();
    // The scale of the noise, with a density of 1 / scale before, is integrated out.
    scores[d] = -0.5 * static_cast<double>(f.freedom) * std::log(f.squares) - f.log_det;
    if (d > 0 && scores[d] <= scores[best]) continue;
    best = d;
    samples.last_readings = readings.rightCols(1);
  }
  const MachineFit& f = fits[static_cast<std::size_t>(best)];
  samples.misfit = f.squares / static_cast<double>(std::max<Index>(1, f.freedom));
  samples.noise_sd = std::sqrt(samples.misfit * f.variance);
  samples.residuals = f.residuals;
  const VectorXd share = shares_of(scores);
  samples.values.resize(static_cast<Index>(draws) * kSamplesOfDraw);
  samples.weights.resize(samples.values.size());
  std::normal_distribution<double> normal;
  VectorXd log_size(draws);
  for (Index d = 0; d < draws; ++d) {
    const MachineFit& m = fits[static_cast<std::size_t>(d)];
    log_size[d] = std::log(std::max(std::abs(m.imbalance), 1e-300));
    std::chi_squared_distribution<double> chi(static_cast<double>(m.freedom));
    for (Index k = 0; k < kSamplesOfDraw; ++k) {
      const double sd = std::sqrt(m.squares / chi(random) * m.variance);
      const std::complex<double> z = m.imbalance + std::complex<double>(sd * normal(random), sd * normal(random));
      samples.values[d * kSamplesOfDraw + k] = z;
      // Even in size instead of over the plane.
      samples.weights[d * kSamplesOfDraw + k] = share[d] / std::max(std::abs(z), 1e-3 * sd);
    }
  }
  samples.weights /= samples.weights.sum();
  const double mean = share.dot(log_size);
  samples.tolerance_sd = std::sqrt(share.dot((log_size.array() - mean).square().matrix()));
  return samples;
}

Estimate shortest_interval(const VectorXd& values, const VectorXd& weights) {
  const auto sorted = sorted_pairs(values, weights);
  Estimate e;
  e.value = weighted_median(sorted);
  std::tie(e.low, e.high) = shortest_window(sorted, 0.95);
  const double mean = values.dot(weights);
  e.sd = std::sqrt(((values.array() - mean).square() * weights.array()).sum());
  return e;
}

Estimate shortest_arc(const VectorXcd& values, const VectorXd& weights) {
  const std::complex<double> mean = (values.array() / values.array().abs() * weights.array()).sum();
  VectorXd from_mean(values.size());
  for (Index k = 0; k < values.size(); ++k) from_mean[k] = std::arg(values[k] * std::conj(mean));
  Estimate e = shortest_interval(from_mean, weights);
  const double shift = std::arg(mean);
  const double held = std::remainder(e.value + shift, kTwoPi) - e.value;
  return {e.value + held, e.sd, e.low + held, e.high + held};
}

}  // namespace whirl::shaft
