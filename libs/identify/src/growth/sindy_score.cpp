#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "trajectory/trajectory_score.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/partwise_score.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification {

Eigen::MatrixXd smoothed_states(const CompiledModel& model, const Recording& r) {
  Eigen::MatrixXd x(r.size(), static_cast<Eigen::Index>(model.states().size()));
  for (std::size_t k = 0; k < model.states().size(); ++k) {
    const std::string& name = model.states()[k];
    const bool rate = !r.has(name) && name.ends_with("'");
    const Channel* channel = r.find(rate ? name.substr(0, name.size() - 1) : name);
    if (channel == nullptr) {
      throw Error::in_field("state without a channel", name, "measured, or the rate of a measured displacement");
    }
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    if (model.discrete() || r.size() < 16) {
      x.col(column) = r[name];
      continue;
    }
    const signal::SmoothedSignal s = detail::without_noise(channel->samples, r.dt, signal::noise_sd(channel->samples));
    x.col(column) = rate ? s.first : s.value;
  }
  return x;
}

Eigen::MatrixXd predict(const IdentifiedModel& model, const Recording& record) {
  const CompiledModel compiled(model);
  std::vector<std::string> names = compiled.states();
  names.insert(names.end(), compiled.inputs().begin(), compiled.inputs().end());
  const bool measured = std::all_of(compiled.states().begin(), compiled.states().end(),
                                    [&](const std::string& s) { return record.has(s); });
  const Eigen::MatrixXd smooth = measured ? Eigen::MatrixXd() : smoothed_states(compiled, record);
  Eigen::MatrixXd in(record.size(), static_cast<Eigen::Index>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    if (record.has(names[k]))
      in.col(column) = record[names[k]];
    else if (names[k] == "t")
      in.col(column) = record.times();
    else if (k < compiled.states().size())
      in.col(column) = smooth.col(column);
    else
      in.col(column) = record[names[k]];  // tells the name that is missing
  }
  return compiled.tape().evaluate(in);
}

ModelRun simulate(const IdentifiedModel& model, const Recording& record) {
  if (detail::needs_trajectory(model, record)) return detail::simulate_trajectory(model, record);
  const CompiledModel compiled(model);
  const int steps = compiled.discrete() ? 1 : input_steps_of(model);
  constexpr Eigen::Index kHead = 16384;  // what comes later says nothing of the start
  const Eigen::MatrixXd head = smoothed_states(compiled, record.size() > kHead ? part_of(record, 0, kHead) : record);
  return simulate(compiled, half_grid_inputs(compiled, record, steps), head.row(0), record.dt, record.size());
}

namespace {

void append(Recording& record, const Recording& part) {
  for (Channel& c : record.channels) {
    Eigen::VectorXd joined(c.samples.size() + part.size());
    joined << c.samples, part[c.name];
    c.samples = std::move(joined);
  }
}

/// Starts that let the first `fitted` samples of every run fit best: a spline is least sure at the end of a record.
void fit_starts(const IdentifiedModel& model, const Recording& record, const Eigen::MatrixXd& inputs,
                const std::vector<Eigen::Index>& firsts, Eigen::Index fitted, int steps, Eigen::MatrixXd& starts) {
  RefineOptions options;
  const CompiledModel compiled(model);
  for (const std::string& s : compiled.states()) {
    if (record.has(s)) options.outputs.push_back(s);
  }
  IdentifiedModel fixed = model;
  for (Equation& e : fixed.equations) {
    for (EquationTerm& t : e.terms) t.coefficient.sd = 0;
  }
  const Eigen::Index outputs = static_cast<Eigen::Index>(options.outputs.size());
  options.output_sd.resize(outputs);
  for (const Eigen::Index first : firsts) {
    const Eigen::Index count = std::min(fitted, record.size() - first);
    if (count * outputs <= 2 * starts.cols()) continue;
    FreeRun run;
    run.start = starts.row(first);
    run.inputs = inputs.middleRows(2 * steps * first, 2 * steps * (count - 1) + 1);
    run.measured.resize(count, outputs);
    for (Eigen::Index k = 0; k < outputs; ++k) {
      const Eigen::VectorXd& y = record[options.outputs[static_cast<std::size_t>(k)]];
      run.measured.col(k) = y.segment(first, count);
      options.output_sd[k] = std::sqrt((y.array() - y.mean()).square().mean());
    }
    const Refined refined = refine_free_run(fixed, {run}, record.dt, options);
    if (!refined.starts.empty()) starts.row(first) = refined.starts.front();
  }
}

}  // namespace

PartwiseScore::PartwiseScore(const IdentifiedModel& model, double horizon, double period)
    : model_(model),
      compiled_(model),
      horizon_(horizon),
      period_(period),
      steps_(compiled_.discrete() ? 1 : input_steps_of(model)) {}

void PartwiseScore::add(const Recording& part) {
  if (part.size() == 0) return;
  if (scores_.empty()) {
    for (const std::string& s : compiled_.states()) {
      if (part.has(s)) scores_.push_back({s, 0, 0, 0});
    }
    sums_.resize(scores_.size());
  }
  for (std::size_t k = 0; k < scores_.size(); ++k) {
    const Eigen::VectorXd& y = part[scores_[k].state];
    Sums& sums = sums_[k];
    if (samples_ == 0) sums.origin = y.mean();
    sums.first += (y.array() - sums.origin).sum();
    sums.second += (y.array() - sums.origin).square().sum();
    if (compiled_.discrete() || y.size() < 17) continue;
    sums.noise += static_cast<double>(y.size()) * std::pow(detail::channel_noise(model_, scores_[k].state, y), 2);
    sums.noise_samples += static_cast<double>(y.size());
  }
  samples_ += part.size();
  // The first part waits for the second: a record that comes whole is seen whole.
  if (waiting_.size() == 0) {
    waiting_ = part;
    return;
  }
  append(waiting_, part);
  follow(false);
}

void PartwiseScore::follow(bool last) {
  constexpr Eigen::Index kContext = 256;  // samples around those scored, for the interpolation of inputs and the starts
  const Eigen::Index ready = last ? waiting_.size() : waiting_.size() - kContext;
  if (horizon_ > 0)
    follow_restarted(ready, last);
  else
    follow_on(ready, last);
  const Eigen::Index drop = std::max<Eigen::Index>(0, next_ - kContext);
  waiting_ = part_of(waiting_, drop, waiting_.size() - drop);
  next_ -= drop;
}

void PartwiseScore::follow_on(Eigen::Index ready, bool last) {
  const Eigen::Index fitted = period_samples(), count = ready - next_;
  if (!last && count < (next_ == 0 ? fitted : 2)) return;
  const Eigen::MatrixXd inputs = half_grid_inputs(compiled_, waiting_, steps_);
  if (state_.size() == 0) {
    Eigen::MatrixXd starts = smoothed_states(compiled_, waiting_);
    if (!compiled_.discrete()) fit_starts(model_, waiting_, inputs, {0}, fitted, steps_, starts);
    state_ = starts.row(0);
  }
  // The last sample is the start of what follows.
  compare(inputs, state_, count, last ? count : count - 1);
}

void PartwiseScore::follow_restarted(Eigen::Index ready, bool last) {
  const Eigen::Index piece = std::max<Eigen::Index>(2, std::lround(horizon_ / waiting_.dt));
  std::vector<Eigen::Index> firsts;
  for (Eigen::Index first = next_; last ? first < ready : first + piece <= ready; first += piece)
    firsts.push_back(first);
  if (firsts.empty()) return;
  const Eigen::MatrixXd inputs = half_grid_inputs(compiled_, waiting_, steps_);
  Eigen::MatrixXd starts = smoothed_states(compiled_, waiting_);
  if (!compiled_.discrete())
    fit_starts(model_, waiting_, inputs, firsts, std::min(piece, period_samples()), steps_, starts);
  for (const Eigen::Index first : firsts) {
    const Eigen::Index count = std::min(piece, ready - first);
    compare(inputs, starts.row(first), count, count);
  }
}

void PartwiseScore::compare(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& start, Eigen::Index count,
                            Eigen::Index counted) {
  const ModelRun run = simulate(compiled_, inputs.middleRows(2 * steps_ * next_, 2 * steps_ * (count - 1) + 1), start,
                                waiting_.dt, count);
  for (StateScore& s : scores_) {
    s.rmse += run.diverged ? std::numeric_limits<double>::infinity()
                           : (run.state(s.state) - waiting_[s.state].segment(next_, count)).head(counted).squaredNorm();
  }
  state_ = run.values.row(count - 1);
  next_ += counted;
}

Eigen::Index PartwiseScore::period_samples() const {
  return std::max<Eigen::Index>(20, std::lround(period_ / waiting_.dt));
}

std::vector<StateScore> PartwiseScore::finish() {
  if (samples_ == 0) return {};
  follow(true);
  for (std::size_t k = 0; k < scores_.size(); ++k) {
    const double n = static_cast<double>(samples_);
    const Sums& sums = sums_[k];
    StateScore& s = scores_[k];
    s.rmse = std::sqrt(s.rmse / n);
    s.nrmse = s.rmse / std::sqrt(sums.second / n - std::pow(sums.first / n, 2));
    s.noise = sums.noise_samples > 0 ? std::sqrt(sums.noise / sums.noise_samples) : 0;
  }
  return scores_;
}

std::vector<StateScore> score(const IdentifiedModel& model, const Recording& record, double horizon) {
  if (detail::needs_trajectory(model, record)) return detail::score_trajectory(model, record, horizon);
  const CompiledModel compiled(model);
  std::vector<std::string> measured;
  for (const std::string& s : compiled.states()) {
    if (record.has(s)) measured.push_back(s);
  }
  PartwiseScore whole(model, horizon, compiled.discrete() ? 0 : characteristic_period(record, measured));
  whole.add(record);
  return whole.finish();
}

HeldOutParts::HeldOutParts(const IdentifiedModel& model, std::string what) : model_(model) {
  result_.what = std::move(what);
}

void HeldOutParts::add(const Recording& part) {
  constexpr Eigen::Index kLead = 65536;  // samples that tell the period
  if (!result_.reason.empty() || part.size() == 0) return;
  try {
    if (whole_) {
      whole_->add(part);
      near_->add(part);
      return;
    }
    if (lead_.size() == 0)
      lead_ = part;
    else
      append(lead_, part);
    if (lead_.size() >= kLead) begin();
  } catch (const Error& e) {
    result_.reason = e.what();
  }
}

void HeldOutParts::begin() {
  const CompiledModel compiled(model_);
  std::vector<std::string> measured;
  for (const std::string& s : compiled.states()) {
    if (lead_.has(s)) measured.push_back(s);
  }
  const double period = compiled.discrete() ? 0 : characteristic_period(lead_, measured);
  result_.horizon = compiled.discrete() ? 10 * lead_.dt : period;
  whole_ = std::make_unique<PartwiseScore>(model_, 0, period);
  near_ = std::make_unique<PartwiseScore>(model_, result_.horizon, period);
  whole_->add(lead_);
  near_->add(lead_);
  lead_ = {};
}

HeldOut HeldOutParts::finish() {
  try {
    if (result_.reason.empty() && !whole_) begin();
    if (result_.reason.empty()) {
      result_.scores = whole_->finish();
      result_.near = near_->finish();
    }
  } catch (const Error& e) {
    result_.reason = e.what();
  }
  return result_;
}

double characteristic_period(const Recording& record, const std::vector<std::string>& states) {
  SindyOptions options;
  options.states = states;
  std::vector<detail::Stretch> stretches = detail::finite_stretches({record}, options);
  detail::smooth_stretches(stretches);
  return 2 * std::numbers::pi / detail::characteristic_rate(stretches);
}

}  // namespace whirl::identification
