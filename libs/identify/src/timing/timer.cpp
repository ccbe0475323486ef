#include "timing/timer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::identification::detail {
namespace {

constexpr Eigen::Index kMost = 20000;

}  // namespace

Timer::Timer(const std::vector<Recording>& records, const SindyOptions& options, std::optional<InputLag> lag)
    : options_(options), lag_(std::move(lag)), data_(options), untouched_(finite_stretches(records, options)) {
  data_.add(lag_ ? with_input_acting(records, *lag_) : records, std::numeric_limits<Eigen::Index>::max());
  data_.finish();
  smooth_stretches(untouched_);
  runs_ = runs_of(options, untouched_);
  for (std::size_t r = 0; lag_ && r < runs_.states.size(); ++r) {
    Eigen::MatrixXd& x = runs_.states[r];
    const Recording& record = runs_.records[r];
    x.conservativeResize(Eigen::NoChange, x.cols() + 1);
    x.rightCols(1) = acting(record[lag_->timing.input], record.dt, *lag_);
  }
  weights_ = output_weights(data_);
  period_ = std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / data_.rate() / runs_.records[0].dt));
}

/// The equation as the candidates have it.
Equation Timer::in_candidates(const Equation& e) const {
  Equation out = e;
  if (lag_) {
    for (EquationTerm& t : out.terms) t.function = in_input(t.function, *lag_);
  }
  return out;
}

TrajectoryFit Timer::fit(const IdentifiedModel& model, const std::vector<InputTiming>& timing, Eigen::Index length,
                         Eigen::Index most, int iterations) const {
  IdentifiedModel timed = model;
  timed.timing = timing;
  TrajectoryModel trajectory = trajectory_model(timed, options_.states);
  const double dt = runs_.records[0].dt;
  std::size_t at = 0;
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : in_candidates(e).terms) {
      TrajectoryParameter& p = trajectory.parameters[at++];
      if (of_lag(e)) {
        p.low = 1e-3 / dt;
        p.high = 2 / dt;  // a faster one is a dead time
        continue;
      }
      const int sign = sign_of(data_.signs(), e.lhs, t.function);
      if (sign > 0) p.low = 0;
      if (sign < 0) p.high = 0;
    }
  }
  TrajectoryOptions o;
  o.output_sd = weights_.sd;
  o.max_iterations = iterations;
  o.most_dead_time = 60 * dt;
  for (const InputTiming& t : timing) {
    if (!options_.timing.dead_time.contains(t.input)) o.free_dead_time.push_back(t.input);
  }
  return fit_trajectory(trajectory, runs_.records, cut_trajectory_runs(runs_, length, most), o);
}

TrajectoryFit Timer::approach(const IdentifiedModel& model, const std::vector<InputTiming>& timing,
                              Eigen::Index& length, Eigen::Index most, int iterations) const {
  constexpr double kFollows = 2;  // noise sd
  TrajectoryFit direct = fit(model, timing, length, most, iterations);
  if (direct.converged && !direct.diverged && direct.rmse < kFollows) return direct;
  TrajectoryFit near = fit(model, timing, period_, most, 40);
  if (near.diverged) return direct;
  IdentifiedModel closer = model;
  closer.timing = timing;
  take_over(near, closer);
  TrajectoryFit again = fit(closer, closer.timing, length, most, 40);
  if (!again.diverged && (direct.diverged || again.rmse < direct.rmse)) direct = std::move(again);
  if (!direct.diverged && direct.rmse < kFollows * std::max(1.0, near.rmse)) return direct;
  // A longer run passes an unstable point on the wrong side.
  length = period_;
  return near;
}

TrajectoryFit Timer::settle(IdentifiedModel& model, std::vector<InputTiming> timing, Eigen::Index& length) const {
  const Shares shares(data_.candidates(), data_.stretches(), options_);
  TrajectoryFit best;
  length = 3 * period_;
  while (true) {
    best = approach(model, timing, length, kMost, 15);
    if (best.diverged) return best;
    take_over(best, model);
    timing = model.timing;
    if (drop_weakest(model, shares)) continue;
    Eigen::Index longest = 0;
    for (const Recording& r : runs_.records) longest = std::max(longest, r.size());
    if (longest < 2 * length) return best;
    const TrajectoryFit longer = fit(model, timing, 4 * length, kMost, 10);
    if (longer.diverged || longer.rmse > 1.1 * best.rmse) return best;
    length *= 4;
    best = longer;
    take_over(best, model);
    timing = model.timing;
  }
}

void Timer::judge(const TrajectoryFit& fit, Eigen::Index length, IdentifiedModel& model) const {
  Summary fresh;
  fresh.condition_number = model.summary.condition_number;
  fresh.chi_square = fit.rmse * fit.rmse;
  fresh.residual = fit.rmse;
  if (!fit.converged) fresh.warn("the refinement on free runs did not converge");
  model.summary = fresh;
  Followed followed;
  followed.horizon = runs_.records[0].dt * static_cast<double>(length);
  followed.output_rmse = fit.output_rmse.cwiseQuotient(weights_.sd);
  judge_refined(data_, weights_, followed, {}, model);
}

bool Timer::drop_weakest(IdentifiedModel& model, const Shares& shares) const {
  double least = 1;
  Equation* equation = nullptr;
  std::size_t term = 0;
  for (Equation& e : model.equations) {
    if (of_lag(e)) continue;
    const Equation own = in_candidates(e);
    const double total = shares.of(own);
    for (std::size_t t = 0; t < e.terms.size(); ++t) {
      const Estimate& c = e.terms[t].coefficient;
      if (c.sd == 0) continue;
      const double share = total > 0 ? std::abs(c.value) * shares.of(own.terms[t].function) / total : 0;
      const double worth =
          std::min(std::abs(c.value) / c.sd / options_.search.t_value, share / options_.search.least_share);
      if (worth >= least) continue;
      least = worth;
      equation = &e;
      term = t;
    }
  }
  if (equation == nullptr || equation->terms.size() < 2) return false;
  equation->terms.erase(equation->terms.begin() + static_cast<std::ptrdiff_t>(term));
  return true;
}

}  // namespace whirl::identification::detail
