#include "output_error/substeps.hpp"

#include <algorithm>
#include <cmath>

#include "rules/rules.hpp"

namespace whirl::identification::detail {

int substeps_for(double change, int steps, int most) {
  constexpr double kShare = 0.25;  // of a standard deviation
  if (!std::isfinite(change)) return steps;
  // Order 4.
  return std::clamp(static_cast<int>(std::ceil(steps * std::sqrt(std::sqrt(change / kShare)))), steps,
                    std::max(steps, most));
}

int substeps_needed(const CompiledModel& model, const std::vector<FreeRun>& one, const std::vector<FreeRun>& two,
                    double dt, const RefineOptions& options) {
  constexpr int kMost = 16;
  std::vector<Eigen::Index> outputs;
  for (const std::string& name : options.outputs)
    outputs.push_back(std::find(model.states().begin(), model.states().end(), name) - model.states().begin());
  const auto columns = static_cast<Eigen::Index>(outputs.size());
  Eigen::ArrayXd moved = Eigen::ArrayXd::Zero(columns), left = moved, rows = moved, energy = moved;
  const bool driven = !model.inputs().empty();
  for (std::size_t k = 0; k < one.size(); ++k) {
    const FreeRun& r = one[k];
    const Eigen::Index n = r.measured.rows();
    const ModelRun coarse = simulate(model, r.inputs, r.start, dt, n, 1e30, 1);
    const ModelRun fine = simulate(model, driven ? two[k].inputs : r.inputs, r.start, dt, n, 1e30, 2);
    if (coarse.diverged || fine.diverged) continue;
    for (Eigen::Index o = 0; o < columns; ++o) {
      const auto state = outputs[static_cast<std::size_t>(o)];
      moved[o] += (coarse.values.col(state) - fine.values.col(state)).squaredNorm();
      for (Eigen::Index i = 0; i < n; ++i) {
        const double error = r.measured(i, o) - fine.values(i, state);
        if (!std::isfinite(error)) continue;
        left[o] += error * error;
        energy[o] += r.measured(i, o) * r.measured(i, o);
        ++rows[o];
      }
    }
  }
  // The noise of few samples a cycle is estimated too large where the motion is fast: what is left of it is never more.
  // Of records without noise an error of this share of the motion is none.
  const double floor = driven ? 1e-4 : 1e-6;
  Eigen::ArrayXd variance = left.max(floor * floor * energy) / rows.cwiseMax(1);
  if (options.output_sd.size() > 0) variance = variance.min(options.output_sd.array().square());
  return substeps_for(std::sqrt((moved / variance.cwiseMax(1e-300)).sum()), 1, kMost);
}

FinerSteps finer_steps(const IdentifiedModel& model, const std::function<std::vector<FreeRun>(int)>& runs, int steps,
                       double dt, RefineOptions options) {
  constexpr double kNegligible = 1e-6;  // of the mean square of the motion
  FinerSteps found{steps, {}, false, 0};
  const std::vector<FreeRun> one = runs(1);
  const int needed = substeps_needed(CompiledModel(model), one, runs(2), dt, options);
  if (needed <= steps) return found;
  options.max_iterations = 8;
  const Refined now = refine_free_run(model, runs(steps), dt, options);
  Refined then = refine_free_run(model, runs(needed), dt, options);
  found.passes = now.passes + then.passes;
  double energy = 0, values = 0;
  for (const FreeRun& r : one) {
    const Eigen::VectorXd weight = options.output_sd.size() > 0 ? Eigen::VectorXd(options.output_sd.cwiseInverse())
                                                                : Eigen::VectorXd::Ones(r.measured.cols());
    const Eigen::MatrixXd weighted = r.measured * weight.asDiagonal();
    energy += weighted.array().isFinite().select(weighted.array(), 0).square().sum();
    values += static_cast<double>(r.measured.size());
  }
  const double left = then.rmse * then.rmse;
  const double gain = values * (now.rmse * now.rmse - left) / std::max({left, kNegligible * energy / values, 1e-300});
  if (then.starts.empty() || !(gain > rules::kTerm || now.starts.empty())) {
    found.against = then.starts.empty() || gain < -rules::kTerm;
    return found;
  }
  found.steps = needed;
  found.fit = std::move(then);
  return found;
}

}  // namespace whirl::identification::detail
