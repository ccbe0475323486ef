#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/noise.hpp"
#include "whirl/sindy/refine.hpp"
#include "whirl/sindy/sindy.hpp"

namespace whirl {

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
    const SmoothedSignal s = detail::without_noise(channel->samples, r.dt, noise_sd(channel->samples));
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
    if (record.has(names[k])) in.col(column) = record[names[k]];
    else if (names[k] == "t") in.col(column) = record.times();
    else if (k < compiled.states().size()) in.col(column) = smooth.col(column);
    else in.col(column) = record[names[k]];  // tells the name that is missing
  }
  return compiled.tape().evaluate(in);
}

ModelRun simulate(const IdentifiedModel& model, const Recording& record) {
  const CompiledModel compiled(model);
  return simulate(compiled, half_grid_inputs(compiled, record), smoothed_states(compiled, record).row(0), record.dt,
                  record.size());
}

namespace {

/// Starts that let the first `fitted` samples of every run fit best: a spline is least sure at the end of a record.
void fit_starts(const IdentifiedModel& model, const Recording& record, const Eigen::MatrixXd& inputs,
                const std::vector<Eigen::Index>& firsts, Eigen::Index fitted, Eigen::MatrixXd& starts) {
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
    run.inputs = inputs.middleRows(2 * first, 2 * count - 1);
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

std::vector<StateScore> score(const IdentifiedModel& model, const Recording& record, double horizon) {
  const CompiledModel compiled(model);
  const Eigen::MatrixXd inputs = half_grid_inputs(compiled, record);
  Eigen::MatrixXd starts = smoothed_states(compiled, record);
  const Eigen::Index n = record.size();
  const Eigen::Index piece = horizon > 0 ? std::max<Eigen::Index>(2, std::lround(horizon / record.dt)) : n;
  std::vector<StateScore> scores;
  for (const std::string& s : compiled.states()) {
    if (record.has(s)) scores.push_back({s, 0, 0, compiled.discrete() ? 0 : noise_sd(record[s])});
  }
  if (!compiled.discrete()) {
    std::vector<Eigen::Index> firsts;
    for (Eigen::Index first = 0; first < n; first += piece) firsts.push_back(first);
    std::vector<std::string> measured;
    for (const StateScore& s : scores) measured.push_back(s.state);
    fit_starts(model, record, inputs, firsts,
               std::min(piece, std::max<Eigen::Index>(20, std::lround(characteristic_period(record, measured) / record.dt))), starts);
  }
  for (Eigen::Index first = 0; first < n; first += piece) {
    const Eigen::Index count = std::min(piece, n - first);
    const ModelRun run = simulate(compiled, inputs.middleRows(2 * first, 2 * count - 1), starts.row(first), record.dt, count);
    for (StateScore& s : scores) {
      s.rmse += run.diverged ? std::numeric_limits<double>::infinity()
                             : (run.state(s.state) - record[s.state].segment(first, count)).squaredNorm();
    }
  }
  for (StateScore& s : scores) {
    const Eigen::VectorXd& y = record[s.state];
    s.rmse = std::sqrt(s.rmse / static_cast<double>(n));
    s.nrmse = s.rmse / std::sqrt((y.array() - y.mean()).square().mean());
  }
  return scores;
}

double characteristic_period(const Recording& record, const std::vector<std::string>& states) {
  SindyOptions options;
  options.states = states;
  std::vector<detail::Stretch> stretches = detail::finite_stretches({record}, options);
  detail::smooth_stretches(stretches);
  return 2 * std::numbers::pi / detail::characteristic_rate(stretches);
}

}  // namespace whirl
