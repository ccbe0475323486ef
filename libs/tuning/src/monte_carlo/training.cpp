#include "monte_carlo/training.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "monte_carlo/machine_lanes.hpp"
#include "monte_carlo/random_numbers.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

constexpr int kMachines = 16;

double cost_of(const LaneRun& run) {
  ClosedLoopMetrics m;
  m.survived = run.judged.survived;
  m.open = run.judged.open;
  m.closed = run.judged.closed;
  m.total_variation = run.judged.total_variation;
  m.standstill_rms = run.judged.standstill_rms;
  m.standing_rms = run.judged.standing_rms;
  m.saturated = run.saturated;
  return tuning_cost(m);
}

/// Distribution of the search, after Ros and Hansen: mean, step, variances, their two paths. By hand: NLopt adapts no
/// covariance.
class Evolution {
 public:
  Evolution(std::vector<double> start, int population)
      : mean_(std::move(start)),
        variance_(mean_.size(), 1),
        step_path_(mean_.size(), 0),
        path_(mean_.size(), 0),
        population_(population) {
    const int parents = population / 2;
    for (int i = 0; i < parents; ++i) weights_.push_back(std::log(parents + 0.5) - std::log(i + 1.0));
    const double sum = std::accumulate(weights_.begin(), weights_.end(), 0.0);
    for (double& w : weights_) w /= sum, effective_ += w * w;
    effective_ = 1 / effective_;
    const auto n = static_cast<double>(mean_.size());
    step_rate_ = (effective_ + 2) / (n + effective_ + 5);
    step_damping_ = 1 + 2 * std::max(0.0, std::sqrt((effective_ - 1) / (n + 1)) - 1) + step_rate_;
    path_rate_ = (4 + effective_ / n) / (n + 4 + 2 * effective_ / n);
    // The diagonal alone is learned: (n + 2) / 3 times as fast.
    const double faster = (n + 2) / 3;
    one_rate_ = std::min(1.0, faster * 2 / ((n + 1.3) * (n + 1.3) + effective_));
    many_rate_ =
        std::min(1 - one_rate_, faster * 2 * (effective_ - 2 + 1 / effective_) / ((n + 2) * (n + 2) + effective_));
    length_ = std::sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n));
  }

  std::vector<std::vector<double>> candidates(std::mt19937_64& random) const {
    std::vector<std::vector<double>> out(static_cast<std::size_t>(population_), mean_);
    for (auto& u : out) {
      for (std::size_t i = 0; i < u.size(); ++i)
        u[i] = std::clamp(u[i] + step_ * std::sqrt(variance_[i]) * normal(random), 0.0, 1.0);
    }
    return out;
  }

  /// The candidates in the order of their cost.
  void learn(const std::vector<const std::vector<double>*>& ranked) {
    const double pull = std::sqrt(path_rate_ * (2 - path_rate_) * effective_);
    double square = 0;
    for (std::size_t i = 0; i < mean_.size(); ++i) {
      double shift = 0, spread = 0;
      for (std::size_t k = 0; k < weights_.size(); ++k) {
        const double d = ((*ranked[k])[i] - mean_[i]) / step_;
        shift += weights_[k] * d;
        spread += weights_[k] * d * d;
      }
      step_path_[i] = (1 - step_rate_) * step_path_[i] +
                      std::sqrt(step_rate_ * (2 - step_rate_) * effective_) * shift / std::sqrt(variance_[i]);
      path_[i] = (1 - path_rate_) * path_[i] + pull * shift;
      variance_[i] =
          (1 - one_rate_ - many_rate_) * variance_[i] + one_rate_ * path_[i] * path_[i] + many_rate_ * spread;
      mean_[i] += step_ * shift;
      square += step_path_[i] * step_path_[i];
    }
    step_ = std::min(0.3, step_ * std::exp(step_rate_ / step_damping_ * (std::sqrt(square) / length_ - 1)));
  }
  const std::vector<double>& mean() const { return mean_; }

 private:
  std::vector<double> mean_, variance_, step_path_, path_, weights_;
  int population_;
  double step_ = 0.06, effective_ = 0;
  double step_rate_ = 0, step_damping_ = 0, path_rate_ = 0, one_rate_ = 0, many_rate_ = 0, length_ = 0;
};

}  // namespace

Training train(const std::function<ControllerDesign(const std::vector<double>&)>& make, std::vector<double> start,
               const IdentifiedModel& model, const Hardware& hardware, long runs, std::uint64_t seed, int threads,
               const std::function<void(double)>& progress) {
  const int population = 4 + static_cast<int>(3 * std::log(static_cast<double>(start.size())));
  MonteCarloOptions draws;
  draws.seed = seed;
  draws.stiffness_sd *= 3, draws.unbalance_sd *= 3, draws.gain_sd *= 3, draws.rotation_sd *= 3;
  draws.sheet_sd = 0;  // sensors and actuators as the data sheet says
  const ControllerDesign first = make(start);
  const RigDraw draw(first.model, model, tuning_hardware(first, hardware), draws);
  const auto like = rig::make_rig_tables(draw(0).rig);
  int machine = 0;
  const auto machines = [&](int count) {
    std::vector<int> indices(static_cast<std::size_t>(count));
    std::iota(indices.begin(), indices.end(), machine);
    machine += count;
    return MachineLanes<kMachines>(draw, indices, like);
  };
  Training out;
  const auto costs = [&](const MachineLanes<kMachines>& on, const std::vector<std::vector<double>>& candidates) {
    std::vector<double> cost(candidates.size(), 0);
    parallel_for(static_cast<int>(candidates.size()), threads, [&](int i) {
      const auto c = static_cast<std::size_t>(i);
      for (const LaneRun& run : on.run(on_scenario(make(candidates[c]), {}))) cost[c] += cost_of(run) / kMachines;
    });
    out.runs += kMachines * static_cast<long>(candidates.size());
    return cost;
  };

  std::mt19937_64 random(seed);
  Evolution evolution(start, population);
  constexpr int kCheck = 2;  // lots of machines on which start and result are compared
  const long generations = std::max(1L, (runs / kMachines - 2 * kCheck) / population);
  for (long g = 0; g < generations; ++g) {
    const auto candidates = evolution.candidates(random);
    const std::vector<double> cost = costs(machines(kMachines), candidates);
    std::vector<std::size_t> order(candidates.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return cost[i]; });
    std::vector<const std::vector<double>*> ranked;
    for (const std::size_t i : order) ranked.push_back(&candidates[i]);
    evolution.learn(ranked);
    if (progress) progress(static_cast<double>(g + 1) / static_cast<double>(generations));
  }
  std::vector<double> mean = evolution.mean();
  for (double& u : mean) u = std::clamp(u, 0.0, 1.0);
  for (int i = 0; i < kCheck; ++i) {
    const std::vector<double> cost = costs(machines(kMachines), {start, mean});
    out.before += cost[0] / kCheck;
    out.after += cost[1] / kCheck;
  }
  if (out.after < out.before) {
    out.best = mean;
  } else {
    out.best = std::move(start);
    out.after = out.before;
  }
  return out;
}

}  // namespace whirl::tuning
