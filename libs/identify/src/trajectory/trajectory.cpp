#include "whirl/identify/trajectory.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "output_error/substeps.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "trajectory/trajectory_system.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/least_squares.hpp"

namespace whirl::identification {
namespace {

detail::TrajectoryRecord prepared(const TrajectoryModel& model, const Recording& record) {
  detail::TrajectoryRecord out;
  out.dt = record.dt;
  out.t0 = record.t0;
  for (const std::string& name : model.inputs) {
    Hold hold = Hold::band_limited;
    for (const InputTiming& t : model.timing) {
      if (t.input == name) hold = t.hold;
    }
    out.inputs.emplace_back(name == "t" && !record.has("t") ? record.times() : record[name], hold);
  }
  out.measured.setConstant(record.size(), static_cast<Eigen::Index>(model.channels.size()), NAN);
  for (std::size_t k = 0; k < model.channels.size(); ++k) {
    if (record.has(model.channels[k])) out.measured.col(static_cast<Eigen::Index>(k)) = record[model.channels[k]];
  }
  return out;
}

Eigen::VectorXd weights_of(const Eigen::VectorXd& sd) {
  return sd.unaryExpr([](double v) { return v > 0 ? 1 / v : 0.0; });
}

void check(const TrajectoryModel& model, const std::vector<Recording>& records, const std::vector<TrajectoryRun>& runs,
           const TrajectoryOptions& options) {
  const auto n = static_cast<Eigen::Index>(model.states.size());
  for (const TrajectoryRun& r : runs) {
    if (r.record >= records.size() || r.first < 0 || r.count < 2 || r.first + r.count > records[r.record].size() ||
        r.start.size() != n)
      throw Error("a run does not fit its record or the model");
  }
  for (const Recording& r : records) {
    if (std::abs(r.dt - records.front().dt) > 1e-9 * r.dt) throw Error("records must have one sample time");
  }
  if (runs.empty()) throw Error("at least one run is needed");
  if (options.output_sd.size() > 0 && options.output_sd.size() != static_cast<Eigen::Index>(model.channels.size()))
    throw Error("one noise sd per channel is needed");
  if ((options.start_sd.size() > 0 && options.start_sd.size() != n) ||
      (options.gap_sd.size() > 0 && options.gap_sd.size() != n) ||
      (!options.free_start.empty() && options.free_start.size() != model.states.size()))
    throw Error("one value per state is needed");
}

struct Point {
  Eigen::VectorXd own;  // free parameters, dead times
  std::vector<TrajectoryRun> runs;
};

/// The trajectory problem as `descend` takes it.
class Problem {
  // rad of the fastest mode: changes damping by 1e-5 of the frequency.
  static constexpr double kFirstStep = 0.35;

 public:
  Problem(const TrajectoryModel& model, const std::vector<Recording>& records, const std::vector<TrajectoryRun>& runs,
          const TrajectoryOptions& options)
      : options_(options),
        weights_{weights_of(options.output_sd), weights_of(options.start_sd), weights_of(options.gap_sd)},
        system_(model, options.free_dead_time, options.substeps),
        given_(runs) {
    for (const Recording& r : records) data_.push_back(prepared(model, r));
    if (options.substeps == 0) system_.set_steps(data_, runs, kFirstStep);
    std::size_t free = 0;
    for (const TrajectoryParameter& p : model.parameters) {
      if (p.free)
        scored_.push_back(std::find(options.scored.begin(), options.scored.end(), p.name) != options.scored.end());
      free += p.free ? 1 : 0;
    }
    scored_.resize(free + options.free_dead_time.size(), false);
    std::tie(low_, high_) =
        system_.limits(options.most_dead_time > 0 ? options.most_dead_time : 50 * records.front().dt);
  }

  Point start() const { return {system_.unknowns(), given_}; }
  void linearise(const Point& point, SquareSum& sum) {
    system_.set_unknowns(point.own);
    sums_ = system_.run(data_, point.runs, given_, weights_);
    sum.cost = sums_.diverged ? std::numeric_limits<double>::infinity() : sums_.objective;
    sum.normal = sums_.normal;
    sum.gradient = sums_.gradient;
    const Eigen::Index own = point.own.size(), states = system_.states();
    for (Eigen::Index k = 0; k < sum.gradient.size(); ++k) {
      const bool start = k >= own;
      // A parameter at its limit that wants beyond stays there.
      const bool held =
          start ? !options_.free_start.empty() && !options_.free_start[static_cast<std::size_t>((k - own) % states)]
                : scored_[static_cast<std::size_t>(k)] || (point.own[k] <= low_[k] && sum.gradient[k] < 0) ||
                      (point.own[k] >= high_[k] && sum.gradient[k] > 0);
      if (!held) continue;
      sum.normal.row(k).setZero();
      sum.normal.col(k).setZero();
      sum.gradient[k] = 0;
    }
  }
  void last(const Point& point, SquareSum& sum) { linearise(point, sum); }
  Point moved(const Point& point, const Eigen::VectorXd& step) const {
    Point next = point;
    const Eigen::Index own = point.own.size(), states = system_.states();
    next.own = (point.own + step.head(own)).cwiseMax(low_).cwiseMin(high_);
    for (std::size_t r = 0; r < next.runs.size(); ++r)
      next.runs[r].start += step.segment(own + states * static_cast<Eigen::Index>(r), states);
    return next;
  }
  bool small(const SquareSum& sum, const Eigen::VectorXd&, double decrease) const {
    return decrease <= options_.tolerance * sum.cost;
  }

  /// Takes more steps where the error of these moves an estimate by more than a quarter of its standard deviation;
  /// false when it does not.
  bool take_finer_steps(const Point& point) {
    constexpr int kMost = 16;
    const int steps = system_.steps();
    if (options_.substeps != 0 || steps >= kMost) return false;
    system_.set_unknowns(point.own);
    const Eigen::VectorXd noise = (sums_.cost_of.array() / sums_.rows_of.array().max(1)).max(1e-300);  // weighted
    double moved = 0;
    for (const TrajectoryRun& r : point.runs) {
      const detail::TrajectoryRecord& record = data_[r.record];
      system_.set_steps(steps);
      const Eigen::MatrixXd coarse = system_.follow(record, r, nullptr);
      system_.set_steps(2 * steps);
      const Eigen::MatrixXd fine = system_.follow(record, r, nullptr);
      if (coarse.size() == 0 || fine.size() == 0) continue;
      for (Eigen::Index o = 0; o < coarse.cols(); ++o) {
        const double w = weights_.output.size() > 0 ? weights_.output[o] : 1;
        moved += w * w * (coarse.col(o) - fine.col(o)).squaredNorm() / noise[o];
      }
    }
    const int needed = detail::substeps_for(std::sqrt(moved), steps, kMost);
    system_.set_steps(needed);
    return needed > steps;
  }
  /// Everything at a point.
  detail::TrajectorySums sums(const Point& point) {
    SquareSum unused;
    linearise(point, unused);
    return sums_;
  }
  TrajectoryModel model() const { return system_.model(); }
  Eigen::Index parameters() const { return system_.parameters(); }

 private:
  const TrajectoryOptions& options_;
  detail::TrajectoryWeights weights_;
  detail::TrajectorySystem system_;
  std::vector<TrajectoryRun> given_;
  std::vector<detail::TrajectoryRecord> data_;
  Eigen::VectorXd low_, high_;
  std::vector<bool> scored_;  // of the free parameters and dead times
  detail::TrajectorySums sums_;
};

/// Scores of the parameters that were held, beside those in `used`.
std::vector<TrajectoryScore> scores_of(const TrajectoryModel& model, const TrajectoryOptions& options,
                                       const detail::TrajectorySums& sums, const std::vector<Eigen::Index>& used,
                                       double variance) {
  const Eigen::MatrixXd n = sums.normal(used, used);
  const Eigen::VectorXd scale = n.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd scaled = scale.asDiagonal() * n * scale.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const Eigen::LDLT<Eigen::MatrixXd> solver(scaled);
  std::vector<TrajectoryScore> scores;
  Eigen::Index k = -1;
  for (const TrajectoryParameter& p : model.parameters) {
    if (p.free) ++k;
    if (!p.free || std::find(options.scored.begin(), options.scored.end(), p.name) == options.scored.end()) continue;
    const Eigen::VectorXd cross = scale.asDiagonal() * sums.normal(used, k);
    const double own = sums.normal(k, k), left = own - cross.dot(solver.solve(cross));
    const double slope =
        sums.gradient[k] - cross.dot(solver.solve(Eigen::VectorXd(scale.asDiagonal() * sums.gradient(used))));
    if (!(left > 1e-9 * own)) continue;  // the same as what is there
    scores.push_back({p.name, slope * slope / left / variance, slope / left});
  }
  std::sort(scores.begin(), scores.end(),
            [](const TrajectoryScore& a, const TrajectoryScore& b) { return a.score > b.score; });
  return scores;
}

}  // namespace

TrajectoryFit fit_trajectory(const TrajectoryModel& model, const std::vector<Recording>& records,
                             const std::vector<TrajectoryRun>& runs, const TrajectoryOptions& options) {
  check(model, records, runs, options);
  Problem problem(model, records, runs, options);
  TrajectoryFit fit{model, runs, {}, {}, 0, 0, 0, {}, 0, false, false};
  Point point = problem.start();
  const Eigen::Index own = point.own.size();
  SquareSum sum;
  problem.linearise(point, sum);
  if (!std::isfinite(sum.cost)) {
    fit.diverged = true;
    return fit;
  }
  DescentReport report = descend(problem, point, sum, options.max_iterations, Damping(options.damping));
  fit.iterations = report.iterations;
  if (problem.take_finer_steps(point)) {
    problem.linearise(point, sum);
    report = descend(problem, point, sum, options.max_iterations);
    fit.iterations += report.iterations;
  }
  fit.converged = report.end == Descent::converged || report.end == Descent::stalled;
  const detail::TrajectorySums sums = problem.sums(point);
  fit.runs = point.runs;
  fit.model = problem.model();
  fit.cost = sums.cost();
  fit.rows = static_cast<Eigen::Index>(sums.rows_of.sum());
  fit.rmse = std::sqrt(fit.cost / std::max<double>(1, static_cast<double>(fit.rows)));
  fit.output_rmse = (sums.cost_of.array() / sums.rows_of.array().max(1)).sqrt();
  if (options.output_sd.size() > 0) fit.output_rmse.array() *= options.output_sd.array();
  std::vector<Eigen::Index> used;  // unknowns that act
  for (Eigen::Index k = 0; k < sum.normal.rows(); ++k) {
    if (sum.normal(k, k) > 0) used.push_back(k);
  }
  const double freedom = static_cast<double>(fit.rows) - static_cast<double>(used.size());
  const Eigen::MatrixXd all =
      invert_information(sum.normal(used, used), 1e-13).covariance * (fit.cost / std::max(1.0, freedom));
  fit.covariance.setConstant(own, own, std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < used.size(); ++i) {
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (used[i] < own && used[j] < own && all.size() > 0)
        fit.covariance(used[i], used[j]) = all(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  if (!options.scored.empty()) fit.scores = scores_of(model, options, sums, used, fit.cost / std::max(1.0, freedom));
  Eigen::Index d = problem.parameters();
  for (const std::string& name : options.free_dead_time) {
    const double sd = std::sqrt(fit.covariance(d, d));
    for (InputTiming& t : fit.model.timing) {
      if (t.input == name) t.dead_time = Estimate::from_sd(t.dead_time.value, sd);
    }
    ++d;
  }
  return fit;
}

Eigen::MatrixXd follow(const TrajectoryModel& model, const Recording& record, const TrajectoryRun& run, int substeps,
                       Eigen::MatrixXd* states) {
  check(model, {record}, {{0, run.first, run.count, run.start}}, {});
  detail::TrajectorySystem system(model, {}, substeps);
  const detail::TrajectoryRecord data = prepared(model, record);
  // A step of 0.1 rad changes the frequency of an oscillation by 1e-6, its damping by 1e-7 of the frequency.
  constexpr double kStep = 0.1;
  if (substeps == 0) system.set_steps({data}, {{0, run.first, run.count, run.start}}, kStep);
  return system.follow(data, run, states);
}

std::vector<detail::TrajectorySums> detail::sums_by_run(const TrajectoryModel& model,
                                                        const std::vector<Recording>& records,
                                                        const std::vector<TrajectoryRun>& runs,
                                                        const Eigen::VectorXd& output_sd) {
  check(model, records, runs, {});
  constexpr double kStep = 0.35;  // rad of the fastest mode
  TrajectorySystem system(model, {}, 0);
  std::vector<TrajectoryRecord> data;
  for (const Recording& r : records) data.push_back(prepared(model, r));
  system.set_steps(data, runs, kStep);
  std::vector<TrajectorySums> sums;
  for (const TrajectoryRun& r : runs) sums.push_back(system.run(data, {r}, {r}, {weights_of(output_sd), {}, {}}));
  return sums;
}

TrajectoryModel trajectory_model(const IdentifiedModel& model, const std::vector<std::string>& channels) {
  TrajectoryModel out;
  out.inputs = model.inputs;
  out.timing = model.timing;
  std::map<std::string, expr::Expr, std::less<>> rates;
  std::size_t count = 0;
  for (const Equation& e : model.equations) {
    if (!e.lhs.ends_with("'")) throw Error("trajectories are of differential equations, not of maps");
    std::vector<expr::Expr> terms;
    for (const EquationTerm& t : e.terms) {
      const std::string name = "_c" + std::to_string(count++);
      out.parameters.push_back({name, t.coefficient.value, t.coefficient.sd != 0});
      terms.push_back(expr::Expr::symbol(name) * expr::Expr::parse(t.function));
    }
    rates.insert_or_assign(e.lhs.substr(0, e.lhs.size() - 1), expr::Expr::sum(terms));
  }
  for (const std::string& s : model.states) {
    const auto at = rates.find(s);
    if (at == rates.end()) {
      out.inputs.push_back(s);  // prescribed
      continue;
    }
    out.states.push_back(s);
    out.rates.push_back(at->second);
  }
  for (const std::string& c : channels) {
    out.channels.push_back(c);
    out.outputs.push_back(expr::Expr::symbol(c));
  }
  return out;
}

void take_over(const TrajectoryFit& fit, IdentifiedModel& model) {
  std::size_t count = 0;
  Eigen::Index free = 0;
  for (Equation& e : model.equations) {
    for (EquationTerm& t : e.terms) {
      const TrajectoryParameter& p = fit.model.parameters.at(count++);
      if (!p.free) continue;
      t.coefficient = Estimate::from_sd(p.value, std::sqrt(fit.covariance(free, free)));
      ++free;
    }
  }
  model.timing = fit.model.timing;
}

}  // namespace whirl::identification
