#include <algorithm>
#include <cmath>

#include "fit/evidence.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;

namespace {

// Vectors of a perfect record are met to this part of their rms: reduced model, modes between nodes, resampling.
constexpr double kModelAccuracy = 3e-4;
constexpr Index kBands = 8;  // of a run: narrow enough for one resonance, wide enough for 20 blocks and more

/// Sum over probes of squared differences from block to block.
double squared_differences(const MatrixXcd& r, Index probe) {
  return (r.row(probe).tail(r.cols() - 1) - r.row(probe).head(r.cols() - 1)).squaredNorm();
}

/// Noise that would stand for the accuracy of the model.
double least_noise(const OrderRun& run, Index probe) {
  const double rms = run.vectors.row(probe).norm() / std::sqrt(static_cast<double>(run.blocks()));
  return kModelAccuracy * rms * std::sqrt(0.5 * run.samples.mean());
}

/// Products of neighbouring residuals, whose mean is zero for noise: their sum over its standard deviation.
double correlation_deviations(const MatrixXcd& r, Index first, Index count) {
  double sum = 0;
  for (Index b = first; b + 1 < first + count; ++b) sum += r.col(b).dot(r.col(b + 1)).real();
  const auto pairs = static_cast<double>((count - 1) * r.rows());
  return sum / std::sqrt(2 * pairs);  // each product of unit normals has variance 1, two of them a pair
}

/// Mean over runs and probes of the residual's variance over that of the run's own scatter, and how far it is from 1.
void compare_with_scatter(const FitProblem& problem, FitMisfit& m) {
  // Standard deviation of the ratio times the root of the blocks: 1.9 to 2.1 by simulation, mostly of the median.
  constexpr double kSpread = 2.0;
  double sum = 0, count = 0, variance = 0;
  for (std::size_t k = 0; k < problem.runs().size(); ++k) {
    const OrderRun& run = problem.runs()[k];
    const MatrixXcd& r = problem.residuals()[k].value;
    const Eigen::VectorXd plain = scatter(run);
    const auto blocks = static_cast<double>(r.cols());
    for (Index p = 0; p < r.rows(); ++p) {
      const double sd = std::max(plain[p], least_noise(run, p)) / problem.noise(k, p);
      sum += r.row(p).squaredNorm() / (2 * blocks * sd * sd);
      variance += kSpread * kSpread / blocks;
      ++count;
    }
  }
  m.scatter_ratio = sum / count;
  m.scatter_deviations = (sum - count) / std::sqrt(variance);
}

}  // namespace

void renew_noise(FitProblem& problem) {
  for (std::size_t r = 0; r < problem.runs().size(); ++r) {
    const MatrixXcd& residual = problem.residuals()[r].value;
    for (Index p = 0; p < residual.rows(); ++p) {
      const double pairs = static_cast<double>(residual.cols() - 1);
      const double seen = problem.noise(r, p) * std::sqrt(squared_differences(residual, p) / (4 * pairs));
      problem.set_noise(r, p, std::max(seen, least_noise(problem.runs()[r], p)));
    }
  }
}

FitMisfit misfit_of(const FitProblem& problem, Index unknowns) {
  FitMisfit m;
  double squares = 0, differences = 0, equations = 0, pairs = 0;
  bool rough = true;  // the residual itself sets the noise everywhere, not the accuracy of the model
  for (std::size_t k = 0; k < problem.runs().size(); ++k) {
    const OrderRun& run = problem.runs()[k];
    const MatrixXcd& r = problem.residuals()[k].value;
    squares += r.squaredNorm();
    equations += 2 * static_cast<double>(r.size());
    for (Index p = 0; p < r.rows(); ++p) {
      const double count = 2 * static_cast<double>(r.cols() - 1);
      const double least = least_noise(run, p) / problem.noise(k, p);
      const double seen = squared_differences(r, p), floor = 2 * count * least * least;
      differences += std::max(seen, floor);
      rough = rough && seen > floor;
      pairs += count;
    }
    const Index bands = std::min(kBands, r.cols() / 8);
    for (Index b = 0; b < bands; ++b) {
      const Index from = b * r.cols() / bands, to = (b + 1) * r.cols() / bands;
      const double z = correlation_deviations(r, from, to - from);
      if (z <= m.band_deviations) continue;
      m.band_deviations = z;
      m.band_run = run.name;
      const double one = run.speed[from], two = run.speed[to - 1];
      m.band_from = std::min(one, two);
      m.band_to = std::max(one, two);
    }
  }
  const double free = std::max(1.0, equations - static_cast<double>(unknowns));
  m.chi_square = (squares / free) / (differences / (2 * pairs));
  m.deviations = (m.chi_square - 1) * std::sqrt(equations);
  compare_with_scatter(problem, m);
  if (!rough) m.deviations = std::max(0.0, m.deviations);
  m.explained = std::abs(m.deviations) <= kMisfitLimit && m.band_deviations <= kBandLimit && !m.above_scatter();
  return m;
}

}  // namespace whirl::shaft
