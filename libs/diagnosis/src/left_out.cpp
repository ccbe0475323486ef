#include "whirl/diagnosis/left_out.hpp"

#include <cmath>

#include "influence_fit.hpp"
#include "near_repeats.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

std::complex<double> foretold_reading(const InfluenceFit& fit, const RunDesign& design, const BalancingRun& run,
                                      Index row) {
  return fit.baseline[row] + fit.drift[row] * (run.time - design.reference) + (fit.influence.row(row) * run.masses)(0);
}

}  // namespace

LeaveStatesOut leave_states_out(const BalancingJob& job, const InfluenceFit& fit) {
  const RunDesign design(job, fit.with_drift);
  const auto rows = static_cast<Index>(job.rows.size());
  LeaveStatesOut result;
  double sum = 0, level = 0, n = 0;
  for (const std::vector<std::size_t>& group : near_repeats(job, fit.used)) {
    LeftOutState state;
    std::vector<bool> others = fit.used;
    for (const std::size_t r : group) {
      state.runs.push_back(static_cast<int>(r));
      others[r] = false;
    }
    state.foretold = state.measured = Eigen::VectorXcd::Constant(rows, {kNaN, kNaN});
    state.told = design.told_by(job, others);
    const InfluenceFit rest = state.told ? solve_runs(job, design, others, 0) : InfluenceFit{};
    double own = 0, read = 0;
    for (Index m = 0; m < rows; ++m) {
      std::complex<double> measured = 0, foretold = 0;
      double count = 0;
      for (const std::size_t r : group) {
        if (std::isnan(std::abs(job.runs[r].vibration[m]))) continue;
        measured += job.runs[r].vibration[m];
        if (state.told) foretold += foretold_reading(rest, design, job.runs[r], m);
        count += 1;
      }
      if (count == 0) continue;
      state.measured[m] = measured / count;
      if (!state.told) continue;
      state.foretold[m] = foretold / count;
      own += std::norm(state.measured[m] - state.foretold[m]);
      level += std::norm(state.measured[m]);
      read += 1;
    }
    state.error = read > 0 ? std::sqrt(own / read) : kNaN;
    sum += own;
    n += read;
    result.states.push_back(std::move(state));
  }
  result.error = n > 0 ? std::sqrt(sum / n) : kNaN;
  result.share = n > 0 && level > 0 ? std::sqrt(sum / level) : kNaN;
  return result;
}

}  // namespace whirl::diagnosis
