#include "timing/sindy_timing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <optional>
#include <set>

#include "problem/sindy_prepare.hpp"
#include "rules/rules.hpp"
#include "timing/timer.hpp"
#include "trajectory/held_input.hpp"
#include "trajectory/input_lag.hpp"
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
      if (d == 0) continue;
      c.samples = read_before(c.samples, d, true);
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
      constexpr int kBits = 8;  // a lag to a hundredth of itself
      const double low = kGrid[best > 0 ? best - 1 : 0], high = kGrid[std::min(best + 1, kGrid.size() - 1)];
      const auto [middle, least] = boost::math::tools::brent_find_minima(at, low, high, kBits);
      lag[j] = least < value[0] ? middle : 0;
    }
  }
  return lag;
}

/// Whether straight lines between the samples of an input are another signal than a band-limited one: it jumps or
/// bends.
bool bends(const std::vector<Recording>& records, const std::string& input) {
  constexpr double kShare = 0.01;
  double difference = 0, spread = 0;
  for (const Recording& r : records) {
    const Eigen::VectorXd& u = r[input];
    if (!u.allFinite() || u.size() < 16) continue;
    const HeldInput smooth(u, Hold::band_limited), lines(u, Hold::first);
    for (Eigen::Index i = 0; i + 1 < u.size(); ++i) {
      const double at = static_cast<double>(i) + 0.5;
      difference += std::pow(smooth.value(at) - lines.value(at), 2);
    }
    spread += (u.array() - u.mean()).square().sum();
  }
  return difference > kShare * kShare * spread;
}

/// The timings to be tried, beginning at a band-limited lag. `sought`: inputs whose holds are.
std::vector<std::vector<InputTiming>> timings_to_try(const SindyOptions& options, const Lags& lag,
                                                     const std::vector<bool>& sought, double dt) {
  std::vector<std::vector<InputTiming>> all{{}};
  for (std::size_t j = 0; j < options.inputs.size(); ++j) {
    const std::string& name = options.inputs[j];
    const auto hold = options.timing.hold.find(name);
    const auto dead = options.timing.dead_time.find(name);
    std::vector<Hold> holds;
    if (hold != options.timing.hold.end())
      holds = {hold->second};
    else if (sought[j])
      holds = {Hold::band_limited, Hold::zero, Hold::first};
    else if (dead != options.timing.dead_time.end())
      holds = {Hold::band_limited};
    if (holds.empty()) continue;
    std::vector<std::vector<InputTiming>> next;
    for (const auto& timing : all) {
      for (const Hold h : holds) {
        const double before = h == Hold::zero ? 0.5 : 0;
        InputTiming t{name, h, {}};
        t.dead_time.value = dead != options.timing.dead_time.end()
                                ? dead->second
                                : dt * std::max(0.0, lag[static_cast<Eigen::Index>(j)] - before);
        if (dead != options.timing.dead_time.end()) t.dead_time.sd = 0;
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
  for (const auto& [name, hold] : options.timing.hold) {
    if (!known(name)) throw Error::in_field("hold", name, "an input");
  }
  for (const auto& [name, seconds] : options.timing.dead_time) {
    if (!known(name)) throw Error::in_field("dead time", name, "an input");
    require_range("dead time of " + name, seconds, 0, 1e6);
  }
}

/// Lags of the inputs, and whether holds and dead times of each are to be tried.
struct Sought {
  Lags lag;
  std::vector<bool> inputs;
  std::set<std::string> jumping;  ///< or bending
};
Sought sought_timing(const std::vector<Recording>& records, const SindyOptions& options, double dt) {
  const std::size_t n = options.inputs.size();
  Sought sought{Lags::Zero(static_cast<Eigen::Index>(n)), std::vector<bool>(n, false), {}};
  std::vector<bool> fixed(n, false);
  for (std::size_t j = 0; j < n; ++j) {
    const auto dead = options.timing.dead_time.find(options.inputs[j]);
    const auto hold = options.timing.hold.find(options.inputs[j]);
    const bool held = hold != options.timing.hold.end() && hold->second == Hold::zero;
    if (dead != options.timing.dead_time.end()) {
      sought.lag[static_cast<Eigen::Index>(j)] = dead->second / dt + (held ? 0.5 : 0);
      fixed[j] = hold != options.timing.hold.end();
    }
    fixed[j] = fixed[j] || (!options.timing.find && hold == options.timing.hold.end());
  }
  sought.lag = weak_lags(records, options, sought.lag, fixed);
  // Samples: less is within what a band-limited reading gets wrong, and what a motion near one frequency cannot tell.
  for (std::size_t j = 0; j < n; ++j) {
    double& lag = sought.lag[static_cast<Eigen::Index>(j)];
    if (!fixed[j] && !options.timing.hold.contains(options.inputs[j]) && lag < rules::kTimingLeast) lag = 0;
    const bool jumps = bends(records, options.inputs[j]);
    if (jumps) sought.jumping.insert(options.inputs[j]);
    sought.inputs[j] = options.timing.find && (lag > 0 || (!fixed[j] && jumps));
  }
  return sought;
}

/// Fall of minus two log likelihoods from one sum of squares to another.
double gain(const TrajectoryFit& from, const TrajectoryFit& to) {
  return 2 * static_cast<double>(to.rows) * std::log(from.rmse / to.rmse);
}

/// Whether `better` pays for `numbers` more and a choice among kinds.
bool worth(const TrajectoryFit& plain, const TrajectoryFit& better, double numbers) {
  if (plain.diverged) return true;
  return gain(plain, better) > (2 + numbers) * std::log(static_cast<double>(better.rows)) + rules::kTerm &&
         better.rmse <= rules::kTimingGain * plain.rmse;
}

/// The best of several timings by short runs. Commands that jump leave a D/A converter in steps: another hold is taken
/// for those (`jumping`) only where it is clearly better; straight lines half a sample earlier read nearly alike.
struct Tried {
  std::optional<TrajectoryFit> best;
  bool hold_open = false;  ///< the records do not tell steps from another hold
};
Tried best_timing(const Timer& timer, const IdentifiedModel& model,
                  const std::vector<std::vector<InputTiming>>& timings, const std::set<std::string>& jumping) {
  const auto steps = [&](const TrajectoryFit& f) {
    const std::vector<InputTiming>& t = f.model.timing;
    return std::all_of(t.begin(), t.end(), [&](const InputTiming& i) {
      return i.hold == Hold::zero || (i.hold == Hold::band_limited && !jumping.contains(i.input));
    });
  };
  std::optional<TrajectoryFit> least, in_steps;
  for (const std::vector<InputTiming>& timing : timings) {
    Eigen::Index length = 3 * timer.period();
    TrajectoryFit trial = timer.approach(model, timing, length, 4000, 8);
    if (trial.diverged) continue;
    if (steps(trial) && (!in_steps || trial.rmse < in_steps->rmse)) in_steps = trial;
    if (!least || trial.rmse < least->rmse) least = std::move(trial);
  }
  Tried tried{least};
  if (least && in_steps && !steps(*least) && gain(*in_steps, *least) < rules::kToldApart) {
    tried.best = in_steps;
    tried.hold_open = true;
  }
  return tried;
}

bool same_holds(const std::vector<InputTiming>& a, const std::vector<InputTiming>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const InputTiming& x, const InputTiming& y) { return x.hold == y.hold; });
}

/// A model with its inputs' timing, fitted.
struct Timed {
  IdentifiedModel model;
  TrajectoryFit fit;
  Eigen::Index length = 0;
  std::vector<BoundOutcome> bounds;
  bool hold_open = false;
};

/// The lag of an actuator that best makes up, in the weak form, for what moves an input by `late` samples in all.
std::optional<InputLag> weak_lag(const std::vector<Recording>& records, const SindyOptions& options,
                                 const InputTiming& timing, double late, double dt) {
  std::optional<InputLag> best;
  double least = std::numeric_limits<double>::infinity();
  for (const double samples : {0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 13.0, 20.0}) {
    const double dead = late - samples - (timing.hold == Hold::zero ? 0.5 : 0);
    if (samples > 1.3 * late + 0.5) break;
    InputLag lag{timing, samples * dt};
    lag.timing.dead_time.value = std::max(0.0, dead) * dt;
    const double left = weak_residual(with_input_acting(records, lag), options,
                                      Lags::Zero(static_cast<Eigen::Index>(options.inputs.size())));
    if (left >= least) continue;
    least = left;
    best = lag;
  }
  return best;
}

/// A timing with the other holds of one input; `from`: where its dead times begin.
std::vector<std::vector<InputTiming>> other_holds(const std::vector<InputTiming>& timing, const InputTiming& from,
                                                  const SindyOptions& options, double dt) {
  std::vector<std::vector<InputTiming>> all;
  for (const Hold hold : {Hold::zero, Hold::first, Hold::band_limited}) {
    if (options.timing.hold.contains(from.input) && options.timing.hold.at(from.input) != hold) continue;
    all.push_back(timing);
    for (InputTiming& i : all.back()) {
      if (i.input != from.input) continue;
      const double half = 0.5 * ((from.hold == Hold::zero) - (hold == Hold::zero));
      i.hold = hold;
      if (!options.timing.dead_time.contains(from.input))
        i.dead_time.value = std::max(0.0, from.dead_time.value + half * dt);
    }
  }
  return all;
}

/// The model with a lag of one of the inputs, where that follows the records clearly better.
std::optional<Timed> with_actuator(const std::vector<Recording>& records, const SindyOptions& options,
                                   const Timed& without, const Sought& sought, double dt) {
  std::optional<Timed> best;
  for (const InputTiming& timing : without.model.timing) {
    const auto j = std::find(options.inputs.begin(), options.inputs.end(), timing.input) - options.inputs.begin();
    const bool fixed = options.timing.dead_time.contains(timing.input);
    const std::optional<InputLag> start =
        weak_lag(records, options, timing, fixed ? timing.dead_time.value / dt + 0.5 : sought.lag[j], dt);
    if (!start) continue;
    Timed trial;
    std::vector<Recording> acting_records = with_input_acting(records, *start);
    const IdentifiedModel seen = fit_untimed(acting_records, options, &trial.bounds);
    if (seen.equations.empty()) continue;
    trial.model = with_lag(seen, *start);
    const Timer timer(records, options, *start);
    const Tried tried =
        best_timing(timer, trial.model, other_holds(without.model.timing, start->timing, options, dt), sought.jumping);
    if (!tried.best) continue;
    trial.fit = timer.settle(trial.model, tried.best->model.timing, trial.length);
    if (trial.fit.diverged) continue;
    // Near the minimum the hold is told better.
    for (const InputTiming& t : std::vector<InputTiming>(trial.model.timing)) {
      if (t.input != timing.input) continue;
      const Tried again =
          best_timing(timer, trial.model, other_holds(trial.model.timing, t, options, dt), sought.jumping);
      trial.hold_open = again.hold_open;
      if (again.best && !same_holds(again.best->model.timing, trial.model.timing))
        trial.fit = timer.settle(trial.model, again.best->model.timing, trial.length);
    }
    if (trial.fit.diverged) continue;
    timer.judge(trial.fit, trial.length, trial.model);
    if (!best || trial.fit.rmse < best->fit.rmse) best = std::move(trial);
  }
  return best;
}

void set_parameters(const TrajectoryFit& fit, IdentifiedModel& model) {
  model.parameters.clear();
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) model.parameters.emplace_back(e.lhs + ": " + t.function, t.coefficient);
    }
  }
  const auto p = static_cast<Eigen::Index>(model.parameters.size());
  const Eigen::MatrixXd covariance = fit.covariance.topLeftCorner(p, p);
  model.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
}

}  // namespace

bool timing_sought(const SindyOptions& o) {
  const bool given = !o.timing.hold.empty() || !o.timing.dead_time.empty();
  if (given && (o.discrete || !o.refine))
    throw Error("holds and dead times need differential equations and refinement");
  return !o.inputs.empty() && !o.discrete && o.refine && (o.timing.find || given);
}

IdentifiedModel fit_timed(const std::vector<Recording>& records, const SindyOptions& options,
                          std::vector<BoundOutcome>* bounds) {
  check_names(options);
  const double dt = records.empty() ? 1 : records.front().dt;
  const IdentifiedModel base = fit_untimed(records, options, bounds);
  const bool measured = base.summary.status != Status::unusable || !base.equations.empty();
  if (!measured) return base;  // no signals to speak of
  const bool asked = !options.timing.hold.empty() || !options.timing.dead_time.empty();
  if (!asked && !base.noise_correlation.empty()) return base;  // explains the records to the last
  const Sought sought = sought_timing(records, options, dt);
  const std::vector<std::vector<InputTiming>> timings = timings_to_try(options, sought.lag, sought.inputs, dt);
  if (timings.size() == 1 && timings.front().empty()) return base;

  Timed found;
  found.model = fit_untimed(with_inputs_late(records, options, sought.lag), options, &found.bounds);
  if (found.model.equations.empty()) return base;
  const Timer timer(records, options);
  const TrajectoryFit plain = timer.fit(base, {}, 3 * timer.period(), 4000, 8);
  const Tried tried = best_timing(timer, found.model, timings, sought.jumping);
  if (!tried.best) return base;
  const std::vector<InputTiming> best = tried.best->model.timing;
  if (!asked && !worth(plain, *tried.best, static_cast<double>(best.size()))) return base;
  found.hold_open = tried.hold_open;
  found.fit = timer.settle(found.model, best, found.length);
  if (found.fit.diverged)
    found.model.timing = best;
  else
    timer.judge(found.fit, found.length, found.model);
  constexpr double kFar = 30;  // residual by noise: what is left is no lag of an actuator
  const double left = found.fit.rmse * found.fit.rmse;
  if (options.timing.find && !(left < rules::kLagLeft) && !(timer.noisy() && found.fit.rmse > kFar)) {
    std::optional<Timed> lagging = with_actuator(records, options, found, sought, dt);
    if (lagging && worth(found.fit, lagging->fit, 1)) found = std::move(*lagging);
  }
  if (found.fit.diverged) return base;
  set_parameters(found.fit, found.model);
  if (found.hold_open && found.model.summary.status != Status::unusable)
    found.model.summary.trust +=
        " The records do not tell steps at the samples of an input from a signal between them with half a sample more "
        "dead time: for inputs that are not constant over samples give --hold.";
  if (bounds != nullptr) *bounds = std::move(found.bounds);
  return found.model;
}

}  // namespace whirl::identification::detail
