#include "trajectory/trajectory_score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "weak/integral_rows.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification::detail {
namespace {

/// Channel of which `state` is the rate; nullptr when it is none.
const Channel* displacement_of(const std::string& state, const Recording& record) {
  return state.ends_with("'") ? record.find(state.substr(0, state.size() - 1)) : nullptr;
}

double spread(const Eigen::VectorXd& y) { return std::sqrt((y.array() - y.mean()).square().mean()); }

std::vector<std::string> measured_states(const IdentifiedModel& model, const Recording& record) {
  std::vector<std::string> names;
  for (const std::string& s : model.states) {
    if (record.has(s)) names.push_back(s);
  }
  return names;
}

/// Sum of squares of a run by the spread of each channel; infinite when it diverges.
double misfit(const TrajectoryModel& model, const Recording& record, const TrajectoryRun& run, Eigen::Index count) {
  TrajectoryRun part = run;
  part.record = 0;
  part.count = std::min(count, run.count);
  const Eigen::MatrixXd predicted = follow(model, record, part);
  if (predicted.size() == 0) return std::numeric_limits<double>::infinity();
  double sum = 0;
  for (std::size_t k = 0; k < model.channels.size(); ++k) {
    const Eigen::VectorXd& y = record[model.channels[k]];
    const double size = std::max(spread(y), std::numeric_limits<double>::min());
    sum += (predicted.col(static_cast<Eigen::Index>(k)) - y.segment(run.first, part.count)).squaredNorm() / size / size;
  }
  return sum / static_cast<double>(part.count);
}

/// A start by more and more of the run where the first samples do not fix it well enough: past an unstable point a run
/// magnifies what they leave open. Only a start that lets the whole run follow better is taken.
void lengthen_start(const TrajectoryModel& model, const Recording& record, Eigen::Index fitted, TrajectoryRun& run) {
  constexpr double kFollows = 1.2;
  double least = misfit(model, record, run, run.count);
  TrajectoryRun trial = run;
  while (fitted < run.count && !(least < kFollows * misfit(model, record, run, fitted))) {
    fitted += (fitted + 1) / 2;
    fit_start(model, record, fitted, trial);
    const double left = misfit(model, record, trial, run.count);
    if (left < least) {
      least = left;
      run = trial;
    }
  }
}

}  // namespace

std::vector<std::string> hidden_states(const IdentifiedModel& model, const Recording& record) {
  std::vector<std::string> hidden;
  for (const std::string& s : model.states) {
    const bool own = std::any_of(model.equations.begin(), model.equations.end(),
                                 [&](const Equation& e) { return e.lhs == s + "'"; });
    if (own && !record.has(s) && displacement_of(s, record) == nullptr) hidden.push_back(s);
  }
  return hidden;
}

bool needs_trajectory(const IdentifiedModel& model, const Recording& record) {
  const bool rates = !model.equations.empty() && model.equations.front().lhs.ends_with("'");
  return rates && !model.rotor && (!model.timing.empty() || !hidden_states(model, record).empty());
}

Eigen::MatrixXd rough_states(const TrajectoryModel& model, const Recording& record) {
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(record.size(), static_cast<Eigen::Index>(model.states.size()));
  for (std::size_t k = 0; k < model.states.size(); ++k) {
    const Channel* own = record.find(model.states[k]);
    const Channel* of = own != nullptr ? own : displacement_of(model.states[k], record);
    if (of == nullptr) continue;
    if (record.size() < 16) {
      if (own != nullptr) x.col(static_cast<Eigen::Index>(k)) = own->samples;
      continue;
    }
    const signal::SmoothedSignal s = without_noise(of->samples, record.dt, signal::noise_sd(of->samples));
    x.col(static_cast<Eigen::Index>(k)) = own != nullptr ? s.value : s.first;
  }
  return x;
}

void fit_start(const TrajectoryModel& model, const Recording& record, Eigen::Index fitted, TrajectoryRun& run) {
  TrajectoryModel fixed = model;
  for (TrajectoryParameter& p : fixed.parameters) p.free = false;
  TrajectoryRun lead = run;
  lead.record = 0;
  lead.count = std::min(run.count, fitted);
  if (lead.count * static_cast<Eigen::Index>(model.channels.size()) <=
      2 * static_cast<Eigen::Index>(model.states.size()))
    return;
  TrajectoryOptions options;
  options.output_sd.resize(static_cast<Eigen::Index>(model.channels.size()));
  for (std::size_t k = 0; k < model.channels.size(); ++k)
    options.output_sd[static_cast<Eigen::Index>(k)] =
        std::max(spread(record[model.channels[k]]), std::numeric_limits<double>::min());
  std::vector<TrajectoryRun> starts{lead};
  // Hidden states from where the inputs bring them, too.
  Eigen::MatrixXd states;
  bool hidden = false;
  for (const std::string& s : model.states)
    hidden = hidden || (!record.has(s) && displacement_of(s, record) == nullptr);
  if (hidden && follow(model, record, lead, 0, &states).size() > 0) {
    starts.push_back(lead);
    for (std::size_t k = 0; k < model.states.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      if (!record.has(model.states[k]) && displacement_of(model.states[k], record) == nullptr)
        starts.back().start[at] = states(lead.count - 1, at);
    }
  }
  double least = std::numeric_limits<double>::infinity();
  for (const TrajectoryRun& start : starts) {
    const TrajectoryFit fit = fit_trajectory(fixed, {record}, {start}, options);
    if (fit.diverged || !(fit.cost < least)) continue;
    least = fit.cost;
    run.start = fit.runs.front().start;
  }
}

ModelRun simulate_trajectory(const IdentifiedModel& model, const Recording& record) {
  const std::vector<std::string> measured = measured_states(model, record);
  const TrajectoryModel trajectory = trajectory_model(model, measured);
  TrajectoryRun run{0, 0, record.size(), rough_states(trajectory, record).row(0)};
  // A file made for its inputs holds the start alone, at rest.
  const bool moves = std::ranges::any_of(measured, [&](const std::string& s) { return spread(record[s]) > 0; });
  if (!hidden_states(model, record).empty() && moves) {
    fit_start(trajectory, record, std::lround(3 * characteristic_period(record, measured) / record.dt), run);
  }
  ModelRun out;
  out.dt = record.dt;
  out.states = trajectory.states;
  if (follow(trajectory, record, run, 0, &out.values).size() == 0 && !measured.empty()) {
    out.diverged = true;
    out.values.setConstant(record.size(), static_cast<Eigen::Index>(out.states.size()),
                           std::numeric_limits<double>::quiet_NaN());
    return out;
  }
  out.valid = record.size();
  return out;
}

std::vector<StateScore> score_trajectory(const IdentifiedModel& model, const Recording& record, double horizon) {
  const std::vector<std::string> measured = measured_states(model, record);
  const TrajectoryModel trajectory = trajectory_model(model, measured);
  const Eigen::MatrixXd rough = rough_states(trajectory, record);
  const double period = characteristic_period(record, measured);
  const bool hidden = !hidden_states(model, record).empty();
  const Eigen::Index fitted = std::max<Eigen::Index>(20, std::lround((hidden ? 3 : 1) * period / record.dt));
  const Eigen::Index n = record.size();
  const Eigen::Index piece =
      horizon > 0 ? std::clamp<Eigen::Index>(std::lround(horizon / record.dt), 2, std::max<Eigen::Index>(2, n)) : n;
  std::vector<StateScore> scores;
  for (const std::string& s : measured) scores.push_back({s, 0, 0, channel_noise(model, s, record[s])});
  double rows = 0;
  for (Eigen::Index first = 0; first + 2 <= n; first += piece) {
    TrajectoryRun run{0, first, std::min(piece, n - first), rough.row(first)};
    fit_start(trajectory, record, fitted, run);
    if (piece == n) lengthen_start(trajectory, record, fitted, run);
    const Eigen::MatrixXd predicted = follow(trajectory, record, run);
    rows += static_cast<double>(run.count);
    for (std::size_t k = 0; k < scores.size(); ++k) {
      scores[k].rmse +=
          predicted.size() == 0
              ? std::numeric_limits<double>::infinity()
              : (predicted.col(static_cast<Eigen::Index>(k)) - record[scores[k].state].segment(first, run.count))
                    .squaredNorm();
    }
  }
  for (StateScore& s : scores) {
    s.rmse = std::sqrt(s.rmse / rows);
    s.nrmse = s.rmse / spread(record[s.state]);
  }
  return scores;
}

}  // namespace whirl::identification::detail
