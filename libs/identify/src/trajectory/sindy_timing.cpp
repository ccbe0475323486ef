#include "trajectory/sindy_timing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "evidence/sindy_verdict.hpp"
#include "problem/sindy_prepare.hpp"
#include "trajectory/held_input.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {
namespace {

using Lags = Eigen::VectorXd;  // per input, samples by which a band-limited reading of it is late

std::vector<Recording> with_inputs_late(const std::vector<Recording>& records, const SindyOptions& options,
                                        const Lags& lag) {
  std::vector<Recording> out = records;
  for (Recording& r : out) {
    for (Channel& c : r.channels) {
      const auto at = std::find(options.inputs.begin(), options.inputs.end(), c.name);
      if (at == options.inputs.end()) continue;
      const double d = lag[at - options.inputs.begin()];
      // A gap would spread over the whole channel.
      if (d == 0 || !c.samples.allFinite()) continue;
      const HeldInput input(c.samples, Hold::band_limited);
      for (Eigen::Index i = 0; i < c.samples.size(); ++i) c.samples[i] = input.value(static_cast<double>(i) - d);
    }
  }
  return out;
}

/// Sum over equations of log residual variance of the weak form with all candidates.
double weak_residual(const std::vector<Recording>& records, const SindyOptions& options, const Lags& lag) {
  SindyData data(options);
  data.add(with_inputs_late(records, options, lag), std::numeric_limits<Eigen::Index>::max());
  data.finish();
  double sum = 0;
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const std::string lhs = options.states[k] + (options.order == 2 ? "''" : "'");
    if (!data.candidates().contains(lhs)) continue;
    regression::SolveOptions all;
    all.method = "ols";
    sum += std::log(std::max(1e-300, regression::solve(data.problem(k), all).residual_variance));
  }
  return sum;
}

/// Lag at which the weak form leaves the least, input by input; those of `fixed` stay.
Lags weak_lags(const std::vector<Recording>& records, const SindyOptions& options, Lags lag,
               const std::vector<bool>& fixed) {
  constexpr std::array kGrid = {0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0, 27.0, 36.0, 50.0};
  const int rounds = lag.size() > 1 ? 2 : 1;
  for (int round = 0; round < rounds; ++round) {
    for (Eigen::Index j = 0; j < lag.size(); ++j) {
      if (fixed[static_cast<std::size_t>(j)]) continue;
      const auto at = [&](double d) {
        Lags trial = lag;
        trial[j] = d;
        return weak_residual(records, options, trial);
      };
      std::size_t best = 0;
      std::array<double, kGrid.size()> value{};
      for (std::size_t k = 0; k < kGrid.size(); ++k) {
        value[k] = at(kGrid[k]);
        if (value[k] < value[best]) best = k;
      }
      double low = kGrid[best > 0 ? best - 1 : 0], high = kGrid[std::min(best + 1, kGrid.size() - 1)];
      constexpr double kGolden = 0.6180339887498949;
      while (high - low > 0.05 * (1 + 0.1 * low)) {
        const double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
        (at(a) < at(b) ? high : low) = at(a) < at(b) ? b : a;
      }
      const double middle = 0.5 * (low + high);
      lag[j] = at(middle) < value[0] ? middle : 0;
    }
  }
  return lag;
}

/// Coefficients, holds and dead times by free runs.
class Timer {
 public:
  Timer(const std::vector<Recording>& records, const SindyOptions& options)
      : options_(options), data_(options), untouched_(finite_stretches(records, options)) {
    data_.add(records, std::numeric_limits<Eigen::Index>::max());
    data_.finish();
    smooth_stretches(untouched_);
    runs_ = runs_of(options, untouched_);
    weights_ = output_weights(data_);
    period_ = std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / data_.rate() / runs_.records[0].dt));
  }

  TrajectoryFit fit(const IdentifiedModel& model, const std::vector<InputTiming>& timing, Eigen::Index length,
                    Eigen::Index most, int iterations) const {
    IdentifiedModel timed = model;
    timed.timing = timing;
    TrajectoryModel trajectory = trajectory_model(timed, options_.states);
    std::size_t at = 0;
    for (const Equation& e : model.equations) {
      for (const EquationTerm& t : e.terms) {
        const int sign = sign_of(data_.signs(), e.lhs, t.function);
        if (sign > 0) trajectory.parameters[at].low = 0;
        if (sign < 0) trajectory.parameters[at].high = 0;
        ++at;
      }
    }
    TrajectoryOptions o;
    o.output_sd = weights_.sd;
    o.max_iterations = iterations;
    o.most_dead_time = 60 * runs_.records[0].dt;
    for (const InputTiming& t : timing) {
      if (!options_.dead_time.contains(t.input)) o.free_dead_time.push_back(t.input);
    }
    return fit_trajectory(trajectory, runs_.records, cut_trajectory_runs(runs_, length, most), o);
  }

  /// Drops terms that exact holds make needless, then fits longer and longer runs while they still follow.
  TrajectoryFit settle(IdentifiedModel& model, std::vector<InputTiming> timing, Eigen::Index& length) const {
    const Shares shares(data_.candidates(), data_.stretches(), options_);
    TrajectoryFit best;
    length = 3 * period_;
    while (true) {
      best = fit(model, timing, length, kMost, 15);
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

  void judge(const TrajectoryFit& fit, Eigen::Index length, IdentifiedModel& model) const {
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

  Eigen::Index period() const { return period_; }

 private:
  static constexpr Eigen::Index kMost = 20000;

  bool drop_weakest(IdentifiedModel& model, const Shares& shares) const {
    double least = 1;
    Equation* equation = nullptr;
    std::size_t term = 0;
    for (Equation& e : model.equations) {
      const double total = shares.of(e);
      for (std::size_t t = 0; t < e.terms.size(); ++t) {
        const Estimate& c = e.terms[t].coefficient;
        if (c.sd == 0) continue;
        const double share = total > 0 ? std::abs(c.value) * shares.of(e.terms[t].function) / total : 0;
        const double worth = std::min(std::abs(c.value) / c.sd / options_.t_value, share / options_.least_share);
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

  const SindyOptions& options_;
  SindyData data_;
  std::vector<Stretch> untouched_;
  RunRecords runs_;
  OutputWeights weights_;
  Eigen::Index period_ = 0;
};

/// The timings to be tried, beginning at a band-limited lag.
std::vector<std::vector<InputTiming>> timings_to_try(const SindyOptions& options, const Lags& lag, double dt) {
  std::vector<std::vector<InputTiming>> all{{}};
  for (std::size_t j = 0; j < options.inputs.size(); ++j) {
    const std::string& name = options.inputs[j];
    const auto hold = options.hold.find(name);
    const auto dead = options.dead_time.find(name);
    std::vector<Hold> holds;
    if (hold != options.hold.end())
      holds = {hold->second};
    else if (options.find_timing && lag[static_cast<Eigen::Index>(j)] > 0)
      holds = {Hold::band_limited, Hold::zero, Hold::first};
    else if (dead != options.dead_time.end())
      holds = {Hold::band_limited};
    if (holds.empty()) continue;
    std::vector<std::vector<InputTiming>> next;
    for (const auto& timing : all) {
      for (const Hold h : holds) {
        const double before = h == Hold::zero ? 0.5 : 0;
        InputTiming t{name, h, {}};
        t.dead_time.value = dead != options.dead_time.end()
                                ? dead->second
                                : dt * std::max(0.0, lag[static_cast<Eigen::Index>(j)] - before);
        if (dead != options.dead_time.end()) t.dead_time.sd = 0;
        next.push_back(timing);
        next.back().push_back(t);
      }
    }
    all = std::move(next);
  }
  return all;
}

void check_names(const SindyOptions& options) {
  const auto known = [&](const std::string& name) {
    return std::find(options.inputs.begin(), options.inputs.end(), name) != options.inputs.end();
  };
  for (const auto& [name, hold] : options.hold) {
    if (!known(name)) throw Error::in_field("hold", name, "an input");
  }
  for (const auto& [name, seconds] : options.dead_time) {
    if (!known(name)) throw Error::in_field("dead time", name, "an input");
    require_range("dead time of " + name, seconds, 0, 1e6);
  }
}

}  // namespace

bool timing_sought(const SindyOptions& o) {
  const bool given = !o.hold.empty() || !o.dead_time.empty();
  if (given && (o.discrete || !o.refine))
    throw Error("holds and dead times need differential equations and refinement");
  return !o.inputs.empty() && !o.discrete && o.refine && (o.find_timing || given);
}

IdentifiedModel fit_timed(const std::vector<Recording>& records, const SindyOptions& options,
                          std::vector<BoundOutcome>* bounds) {
  check_names(options);
  const double dt = records.empty() ? 1 : records.front().dt;
  Lags lag = Lags::Zero(static_cast<Eigen::Index>(options.inputs.size()));
  std::vector<bool> fixed(options.inputs.size(), false);
  for (std::size_t j = 0; j < options.inputs.size(); ++j) {
    const auto dead = options.dead_time.find(options.inputs[j]);
    const auto hold = options.hold.find(options.inputs[j]);
    const bool held = hold != options.hold.end() && hold->second == Hold::zero;
    if (dead != options.dead_time.end()) {
      lag[static_cast<Eigen::Index>(j)] = dead->second / dt + (held ? 0.5 : 0);
      fixed[j] = hold != options.hold.end();
    }
    fixed[j] = fixed[j] || (!options.find_timing && hold == options.hold.end());
  }
  const IdentifiedModel base = fit_untimed(records, options, bounds);
  const bool measured = base.summary.status != Status::unusable || !base.equations.empty();
  if (!measured) return base;  // no signals to speak of
  lag = weak_lags(records, options, lag, fixed);
  constexpr double kClear = 0.15;  // samples: less is within what a band-limited reading gets wrong
  for (std::size_t j = 0; j < fixed.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (!fixed[j] && !options.hold.contains(options.inputs[j]) && lag[at] < kClear) lag[at] = 0;
  }
  const std::vector<std::vector<InputTiming>> timings = timings_to_try(options, lag, dt);
  if (timings.size() == 1 && timings.front().empty()) return base;

  std::vector<BoundOutcome> late_bounds;
  IdentifiedModel model = fit_untimed(with_inputs_late(records, options, lag), options, &late_bounds);
  if (model.equations.empty()) return base;
  const Timer timer(records, options);
  const std::vector<InputTiming>* chosen = nullptr;
  TrajectoryFit least, plain = timer.fit(base, {}, 3 * timer.period(), 4000, 8);
  std::vector<InputTiming> best;
  for (const std::vector<InputTiming>& timing : timings) {
    TrajectoryFit trial = timer.fit(model, timing, 3 * timer.period(), 4000, 8);
    if (trial.diverged || (chosen != nullptr && trial.cost >= least.cost)) continue;
    least = std::move(trial);
    best = least.model.timing;
    chosen = &timing;
  }
  const bool asked = !options.hold.empty() || !options.dead_time.empty();
  if (chosen == nullptr) return base;
  const double rows = static_cast<double>(least.rows);
  // One more number per input, and a choice among holds.
  const bool worth = plain.diverged || rows * std::log(plain.cost / least.cost) >
                                           (2 + static_cast<double>(best.size())) * std::log(rows) + 16;
  if (!asked && (!worth || least.cost > 0.95 * plain.cost)) return base;
  Eigen::Index length = 0;
  TrajectoryFit fit = timer.settle(model, best, length);
  if (fit.diverged) return base;
  timer.judge(fit, length, model);
  model.parameters.clear();
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) model.parameters.emplace_back(e.lhs + ": " + t.function, t.coefficient);
    }
  }
  const auto p = static_cast<Eigen::Index>(model.parameters.size());
  const Eigen::MatrixXd covariance = fit.covariance.topLeftCorner(p, p);
  model.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
  if (bounds != nullptr) *bounds = std::move(late_bounds);
  return model;
}

}  // namespace whirl::identification::detail
