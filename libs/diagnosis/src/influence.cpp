#include "whirl/diagnosis/influence.hpp"

#include <fmt/format.h>

#include <cmath>

#include "contradiction.hpp"
#include "influence_fit.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {

using Eigen::Index;

void BalancingJob::check() const {
  if (planes.empty() || rows.empty()) throw Error("balancing: no plane or no reading");
  if (runs.empty()) throw Error("balancing: no run");
  if (!speed.empty() && speed.size() != rows.size()) throw Error("balancing: one speed a row is needed");
  for (const BalancingRun& run : runs) {
    if (run.masses.size() != static_cast<Index>(planes.size()))
      throw Error(fmt::format("run '{}': {} masses for {} planes", run.name, run.masses.size(), planes.size()));
    if (!run.masses.allFinite()) throw Error(fmt::format("run '{}': a mass is not finite", run.name));
    if (!std::isfinite(run.time)) throw Error(fmt::format("run '{}': the time is not finite", run.name));
    if (run.vibration.size() != static_cast<Index>(rows.size()))
      throw Error(fmt::format("run '{}': {} readings for {} rows", run.name, run.vibration.size(), rows.size()));
    for (Index m = 0; m < run.vibration.size(); ++m)
      if (std::isinf(std::abs(run.vibration[m])))
        throw Error(
            fmt::format("run '{}': the reading of {} is infinite", run.name, rows[static_cast<std::size_t>(m)]));
  }
}

double InfluenceFit::sd(Index row, Index plane) const {
  const Index k = 1 + (with_drift ? 1 : 0) + plane;
  return noise[row] * std::sqrt(std::max(0.0, cofactor[static_cast<std::size_t>(row)](k, k).real()));
}

namespace {

/// Which planes the masses of the runs leave unknown.
void require_trials(const BalancingJob& job, const RunDesign& design, const std::vector<bool>& used) {
  for (std::size_t m = 0; m < job.rows.size(); ++m) {
    const Eigen::MatrixXcd x = design.rows_of(job, static_cast<Index>(m), used);
    const std::string& row = job.rows[m];
    if (x.rows() == 0) throw Error(fmt::format("{}: no run has a reading", row));
    Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> qr(x);
    qr.setThreshold(1e-9);
    if (qr.rank() == x.cols()) continue;
    // A combination of planes (and of the state as found) that no run shows.
    Eigen::JacobiSVD<Eigen::MatrixXcd> svd(x, Eigen::ComputeFullV);
    const Eigen::VectorXcd blind = svd.matrixV().col(x.cols() - 1);
    std::string planes;
    for (std::size_t p = 0; p < job.planes.size(); ++p)
      if (std::abs(blind[design.first_plane() + static_cast<Index>(p)]) > 1e-6)
        planes += (planes.empty() ? "" : ", ") + job.planes[p];
    throw Error(
        fmt::format("{}: the {} run{} that read it do not tell the influence of {}: make a run that differs from "
                    "the others by a mass there alone",
                    row, x.rows(), x.rows() == 1 ? "" : "s", planes.empty() ? "the planes" : "plane " + planes));
  }
}

void describe(const BalancingJob& job, const Contradiction& c, bool excluded, Summary& summary) {
  const std::string& name = job.runs[static_cast<std::size_t>(c.run)].name;
  const std::string slip = c.slip.empty() ? "" : ": looks as if " + c.slip;
  if (c.or_run.empty()) {
    summary.warn(fmt::format("run '{}' contradicts the others{}{}", name, slip, excluded ? "; it is left out" : ""));
    return;
  }
  std::string others;
  for (const int r : c.or_run)
    others += fmt::format("{}'{}'", others.empty() ? "" : ", ", job.runs[static_cast<std::size_t>(r)].name);
  summary.fail(fmt::format(
      "runs '{}' and {} contradict each other and nothing tells which is wrong: repeat one of them", name, others));
}

double repeat_scatter(const BalancingJob& job, const RunDesign& design, const InfluenceFit& fit,
                      const std::vector<bool>& used) {
  double sum = 0, freedom = 0;
  std::vector<bool> done(job.runs.size(), false);
  for (std::size_t i = 0; i < job.runs.size(); ++i) {
    if (done[i] || !used[i]) continue;
    std::vector<std::size_t> same;
    for (std::size_t j = i; j < job.runs.size(); ++j) {
      if (!used[j] || (job.runs[j].masses - job.runs[i].masses).norm() > 1e-9 * (1e-30 + job.runs[i].masses.norm()))
        continue;
      same.push_back(j);
      done[j] = true;
    }
    for (Index m = 0; m < static_cast<Index>(job.rows.size()); ++m) {
      std::complex<double> mean = 0;
      double n = 0, square = 0;
      const auto steady = [&](std::size_t j) {
        return job.runs[j].vibration[m] - fit.drift[m] * (job.runs[j].time - design.reference);
      };
      for (const std::size_t j : same)
        if (!std::isnan(std::abs(job.runs[j].vibration[m]))) mean += steady(j), n += 1;
      if (n < 2) continue;
      for (const std::size_t j : same)
        if (!std::isnan(std::abs(job.runs[j].vibration[m]))) square += std::norm(steady(j) - mean / n);
      sum += square;
      freedom += 2 * (n - 1);
    }
  }
  return freedom > 0 ? std::sqrt(sum / freedom) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

InfluenceFit fit_influence(const BalancingJob& job, const InfluenceOptions& options) {
  job.check();
  require_range("noise", options.noise, 0, 1e3, "m");
  require_range("alarm", options.alarm, 0, 1);
  std::vector<bool> used(job.runs.size(), true);
  RunDesign design(job, false);
  require_trials(job, design, used);
  const auto spare = static_cast<Index>(job.runs.size()) - 1 - static_cast<Index>(job.planes.size());
  if (options.drift == Drift::linear || (options.drift == Drift::automatic && spare >= 2)) {
    const RunDesign drifting(job, true);
    bool told = true;
    for (std::size_t m = 0; m < job.rows.size(); ++m) {
      const Eigen::MatrixXcd x = drifting.rows_of(job, static_cast<Index>(m), used);
      Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> qr(x);
      qr.setThreshold(1e-6);
      told = told && qr.rank() == x.cols() && (options.drift == Drift::linear || x.rows() > x.cols());
    }
    if (!told && options.drift == Drift::linear)
      throw Error("the drift cannot be told: repeat the run as found at the end of the job");
    if (told) design = drifting;
  }
  ContradictionSearch search(job, design, options);
  std::vector<Contradiction> found = search.run(used);
  InfluenceFit fit = solve_runs(job, design, used, options.noise);
  fit.contradictions = std::move(found);
  fit.angles_reversed = search.angles_reversed();
  fit.untested = search.untested();
  fit.repeatability = repeat_scatter(job, design, fit, used);
  for (const Contradiction& c : fit.contradictions) describe(job, c, options.exclude, fit.summary);
  if (fit.angles_reversed)
    fit.summary.warn(
        "the runs agree far better when every mass angle is counted the other way: looks as if angles and "
        "phases are counted in opposite senses; check the convention");
  if (!fit.noise.allFinite())
    fit.summary.warn(
        "no run repeats what another one tells: the scatter is not known and no interval can be given; "
        "repeat the run as found, or state the noise");
  return fit;
}

}  // namespace whirl::diagnosis
