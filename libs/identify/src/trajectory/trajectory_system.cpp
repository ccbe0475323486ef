#include "trajectory/trajectory_system.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::identification::detail {
namespace {

constexpr double kFar = 1e12;  // beyond it a state has diverged

bool uses(const std::vector<expr::Expr>& all, const std::string& name) {
  return std::any_of(all.begin(), all.end(), [&](const expr::Expr& e) {
    const std::vector<std::string> names = expr::variables(e);
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

}  // namespace

TrajectorySystem::TrajectorySystem(const TrajectoryModel& model, const std::vector<std::string>& free_dead_time,
                                   int substeps)
    : model_(model),
      substeps_(std::max(1, substeps)),
      n_(static_cast<Eigen::Index>(model.states.size())),
      q_(static_cast<Eigen::Index>(model.outputs.size())) {
  if (model.rates.size() != model.states.size()) throw Error("a trajectory model needs one rate per state");
  if (model.outputs.size() != model.channels.size()) throw Error("a trajectory model needs one channel per output");
  const auto input_of = [&](const std::string& name) {
    const auto at = std::find(model.inputs.begin(), model.inputs.end(), name);
    if (at == model.inputs.end()) throw Error::in_field("input", name, "an input of the model");
    return static_cast<std::size_t>(at - model.inputs.begin());
  };
  hold_.assign(model.inputs.size(), Hold::band_limited);
  dead_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.inputs.size()));
  for (const InputTiming& t : model.timing) {
    hold_[input_of(t.input)] = t.hold;
    if (std::isfinite(t.dead_time.value)) dead_[static_cast<Eigen::Index>(input_of(t.input))] = t.dead_time.value;
  }
  for (const std::string& name : free_dead_time) delayed_.push_back(input_of(name));
  std::vector<expr::Expr> all = model.rates;
  all.insert(all.end(), model.outputs.begin(), model.outputs.end());
  time_ = uses(all, "t") && std::find(model.inputs.begin(), model.inputs.end(), "t") == model.inputs.end();
  m_ = static_cast<Eigen::Index>(model.inputs.size()) + (time_ ? 1 : 0);

  std::vector<std::string> names = model.states;
  names.insert(names.end(), model.inputs.begin(), model.inputs.end());
  if (time_) names.emplace_back("t");
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    names.push_back(model.parameters[k].name);
    if (model.parameters[k].free) free_.push_back(k);
  }
  p_ = static_cast<Eigen::Index>(free_.size());
  const auto compile = [&](const std::vector<expr::Expr>& functions, std::vector<Entry>& by_state,
                           std::vector<Entry>& by_parameter, std::vector<Entry>* by_input) {
    std::vector<expr::Expr> list = functions;
    const auto differentiate = [&](const std::string& name, Eigen::Index column, std::vector<Entry>& entries) {
      for (std::size_t i = 0; i < functions.size(); ++i) {
        expr::Expr d = expr::differentiate(functions[i], name);
        if (d.is_number(0)) continue;
        entries.push_back({static_cast<Eigen::Index>(i), column});
        list.push_back(std::move(d));
      }
    };
    for (Eigen::Index j = 0; j < n_; ++j) differentiate(model.states[static_cast<std::size_t>(j)], j, by_state);
    for (Eigen::Index k = 0; k < p_; ++k)
      differentiate(model.parameters[free_[static_cast<std::size_t>(k)]].name, k, by_parameter);
    if (by_input != nullptr) {
      for (std::size_t d = 0; d < delayed_.size(); ++d)
        differentiate(model.inputs[delayed_[d]], static_cast<Eigen::Index>(d), *by_input);
    }
    return expr::compile(list, names, static_cast<std::size_t>(n_ + m_));
  };
  rates_ = compile(model.rates, by_state_, by_parameter_, &by_input_);
  outputs_ = compile(model.outputs, seen_by_state_, seen_by_parameter_, nullptr);
  in_.setZero(static_cast<Eigen::Index>(names.size()));
  out_.setZero(static_cast<Eigen::Index>(std::max(rates_.n_outputs(), outputs_.n_outputs())));
  dx_.setZero(n_);
  y_.setZero(q_);
  jacobian_.setZero(n_, n_);
  seen_.setZero(q_, n_);
  const Eigen::Index own = p_ + delays();
  sensitivities_ = SensitivityStep(n_, own, by_state_);
  for (const Entry& e : by_parameter_) forced_.push_back(e.column + e.row * sensitivities_.stage(0).forcing.rows());
  for (Eigen::VectorXd& rates : stage_rates_) rates.setZero(n_);
  reached_.resize(model.inputs.size());
  acting_.setZero(m_, 3);
  seen_parameter_.setZero(own, q_);
  set_unknowns(unknowns());
}

Eigen::VectorXd TrajectorySystem::unknowns() const {
  Eigen::VectorXd v(p_ + delays());
  for (Eigen::Index k = 0; k < p_; ++k) v[k] = model_.parameters[free_[static_cast<std::size_t>(k)]].value;
  for (Eigen::Index d = 0; d < delays(); ++d)
    v[p_ + d] = dead_[static_cast<Eigen::Index>(delayed_[static_cast<std::size_t>(d)])];
  return v;
}

void TrajectorySystem::set_unknowns(const Eigen::VectorXd& values) {
  for (Eigen::Index k = 0; k < p_; ++k) model_.parameters[free_[static_cast<std::size_t>(k)]].value = values[k];
  for (Eigen::Index d = 0; d < delays(); ++d)
    dead_[static_cast<Eigen::Index>(delayed_[static_cast<std::size_t>(d)])] = values[p_ + d];
  for (std::size_t k = 0; k < model_.parameters.size(); ++k)
    in_[n_ + m_ + static_cast<Eigen::Index>(k)] = model_.parameters[k].value;
  rates_.hold(in_.data() + n_ + m_, rate_slots_);
  outputs_.hold(in_.data() + n_ + m_, output_slots_);
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> TrajectorySystem::limits(double most_dead_time) const {
  Eigen::VectorXd low = Eigen::VectorXd::Zero(p_ + delays()),
                  high = Eigen::VectorXd::Constant(p_ + delays(), most_dead_time);
  for (Eigen::Index k = 0; k < p_; ++k) {
    low[k] = model_.parameters[free_[static_cast<std::size_t>(k)]].low;
    high[k] = model_.parameters[free_[static_cast<std::size_t>(k)]].high;
  }
  return {low, high};
}

TrajectoryModel TrajectorySystem::model() const {
  TrajectoryModel model = model_;
  for (const std::size_t j : delayed_) {
    auto at = std::find_if(model.timing.begin(), model.timing.end(),
                           [&](const InputTiming& t) { return t.input == model.inputs[j]; });
    if (at == model.timing.end()) at = model.timing.insert(at, {model.inputs[j], hold_[j], {}});
    at->dead_time.value = dead_[static_cast<Eigen::Index>(j)];
  }
  return model;
}

Eigen::VectorXd TrajectorySystem::dead_samples(double dt) const { return dead_ / dt; }

/// The input at a place of its own time: a step begins where the one before it ended, and there a sample is compared.
double TrajectorySystem::input(const TrajectoryRecord& record, std::size_t j, double at) {
  Reached& last = reached_[j];
  if (last.of != &record || last.at != at) last = {&record, at, record.inputs[j].value(at)};
  return last.value;
}

void TrajectorySystem::load_inputs(const TrajectoryRecord& record, double at) {
  for (std::size_t j = 0; j < record.inputs.size(); ++j) {
    const Eigen::Index k = static_cast<Eigen::Index>(j);
    in_[n_ + k] = input(record, j, at - dead_[k] / record.dt);
  }
  if (time_) in_[n_ + m_ - 1] = record.t0 + at * record.dt;
}

void TrajectorySystem::set_steps(const std::vector<TrajectoryRecord>& records, const std::vector<TrajectoryRun>& runs,
                                 double step) {
  constexpr std::size_t kMostRuns = 32;
  constexpr int kMostSteps = 16;
  substeps_ = 1;
  reached_.assign(reached_.size(), {});
  for (std::size_t k = 0; k < std::min(kMostRuns, runs.size()); ++k) {
    const TrajectoryRun& run = runs[k * runs.size() / std::min(kMostRuns, runs.size())];
    const TrajectoryRecord& record = records[run.record];
    load_inputs(record, static_cast<double>(run.first));
    rate(run.start, true);
    if (!jacobian_.allFinite()) continue;
    const double fastest = jacobian_.eigenvalues().cwiseAbs().maxCoeff() * record.dt;
    substeps_ = std::clamp(static_cast<int>(std::ceil(fastest / step)), substeps_, kMostSteps);
  }
}

void TrajectorySystem::rate(const Eigen::VectorXd& x, bool sensitive) {
  in_.head(n_) = x;
  rates_.evaluate_held(in_.data(), rate_slots_, out_.data());
  dx_ = out_.head(n_);
  if (!sensitive) return;
  Eigen::Index at = n_;
  for (const Entry& e : by_state_) jacobian_(e.row, e.column) = out_[at++];
}

/// Stage k of a step: the rates at in_.
void TrajectorySystem::stage(const TrajectoryRecord& record, const HeldStep& step, int k, bool sensitive) {
  rates_.evaluate_held(in_.data(), rate_slots_, out_.data());
  const double* value = out_.data();
  double* const rates = stage_rates_[static_cast<std::size_t>(k)].data();
  for (Eigen::Index i = 0; i < n_; ++i) rates[i] = *value++;
  if (!sensitive) return;
  SensitivityStep::Stage& out = sensitivities_.stage(k);
  for (double& j : out.jacobian) j = *value++;
  double* const forcing = out.forcing.data();
  for (const Eigen::Index place : forced_) forcing[place] = *value++;
  for (const Entry& e : by_input_) {  // -df/du u' of smooth inputs
    const std::size_t j = delayed_[static_cast<std::size_t>(e.column)];
    const double share = hold_[j] == Hold::first ? 0.5 : 0.5 * ((k + 1) / 2);
    const double at = step.begin + share * step.length - dead_[static_cast<Eigen::Index>(j)] / record.dt;
    out.forcing(p_ + e.column, e.row) = -*value++ * (record.inputs[j].slope(at) / record.dt);
  }
}

void TrajectorySystem::step(const TrajectoryRecord& record, const HeldStep& step, bool sensitive, State& at) {
  const double h = step.length * record.dt, middle = step.begin + 0.5 * step.length;
  Eigen::Matrix<double, Eigen::Dynamic, 3>& u = acting_;
  for (std::size_t j = 0; j < record.inputs.size(); ++j) {
    const Eigen::Index k = static_cast<Eigen::Index>(j);
    const double dead = dead_[k] / record.dt;
    if (hold_[j] == Hold::zero) {  // switches are at the ends of steps: never asked for there
      u.row(k).setConstant(record.inputs[j].value(middle - dead));
    } else {
      u(k, 0) = input(record, j, step.begin - dead);
      u(k, 1) = record.inputs[j].value(middle - dead);
      u(k, 2) = input(record, j, step.begin + step.length - dead);
    }
  }
  if (time_) {
    for (int c = 0; c < 3; ++c) u(m_ - 1, c) = record.t0 + (step.begin + 0.5 * c * step.length) * record.dt;
  }
  // Loops of their own: of so few numbers an expression of Eigen costs more than the sums.
  double *const x = at.x.data(), *const in = in_.data();
  for (Eigen::Index i = 0; i < n_; ++i) in[i] = x[i];
  for (int k = 0; k < 4; ++k) {
    const double* const acting = u.col((k + 1) / 2).data();
    for (Eigen::Index i = 0; i < m_; ++i) in[n_ + i] = acting[i];
    stage(record, step, k, sensitive);
    const double ahead = k < 2 ? 0.5 * h : h;
    const double* const rates = stage_rates_[static_cast<std::size_t>(k)].data();
    for (Eigen::Index i = 0; k < 3 && i < n_; ++i) in[i] = x[i] + ahead * rates[i];
  }
  const double share = h / 6;
  const double *const r0 = stage_rates_[0].data(), *const r1 = stage_rates_[1].data(),
                      *const r2 = stage_rates_[2].data(), *const r3 = stage_rates_[3].data();
  for (Eigen::Index i = 0; i < n_; ++i) x[i] += share * (r0[i] + 2 * (r1[i] + r2[i]) + r3[i]);
  if (sensitive) sensitivities_.advance(h, at.s);
}

void TrajectorySystem::jump(const TrajectoryRecord& record, const HeldStep& step, State& at) {
  const double middle = step.begin + 0.5 * step.length;
  for (Eigen::Index d = 0; d < delays(); ++d) {
    const std::size_t j = delayed_[static_cast<std::size_t>(d)];
    if (hold_[j] != Hold::zero || ((step.switched >> (j % 64)) & 1) == 0) continue;
    load_inputs(record, middle);
    const Eigen::Index k = static_cast<Eigen::Index>(j);
    const double after = in_[n_ + k];
    const double before = record.inputs[j].value(middle - dead_[k] / record.dt - 1);
    if (after == before) continue;
    rate(at.x, false);
    const Eigen::VectorXd late = dx_;
    in_[n_ + k] = before;
    rate(at.x, false);
    at.s.row(p_ + d) += (dx_ - late).transpose();
  }
}

void TrajectorySystem::look(const TrajectoryRecord& record, double at, const Eigen::VectorXd& x, bool sensitive) {
  load_inputs(record, at);
  in_.head(n_) = x;
  outputs_.evaluate_held(in_.data(), output_slots_, out_.data());
  y_ = out_.head(q_);
  if (!sensitive) return;
  Eigen::Index o = q_;
  for (const Entry& e : seen_by_state_) seen_(e.row, e.column) = out_[o++];
  for (const Entry& e : seen_by_parameter_) seen_parameter_(e.column, e.row) = out_[o++];
}

Eigen::MatrixXd TrajectorySystem::follow(const TrajectoryRecord& record, const TrajectoryRun& run,
                                         Eigen::MatrixXd* states) {
  reached_.assign(reached_.size(), {});
  Eigen::MatrixXd out(run.count, q_);
  if (states != nullptr) states->resize(run.count, n_);
  State at;
  at.x = run.start;
  Eigen::Index i = 0;
  const auto record_sample = [&] {
    look(record, static_cast<double>(run.first + i), at.x, false);
    out.row(i) = y_;
    if (states != nullptr) states->row(i) = at.x;
    ++i;
    return at.x.allFinite() && at.x.cwiseAbs().maxCoeff() < kFar;
  };
  for (const HeldStep& s : held_steps(record.inputs, dead_samples(record.dt), run.first, run.count, substeps_)) {
    if (s.sample && !record_sample()) return {};
    step(record, s, false, at);
  }
  return record_sample() ? out : Eigen::MatrixXd();
}

void TrajectorySystem::add_run(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, std::size_t run,
                               TrajectorySums& sums) const {
  const Eigen::Index own = p_ + delays(), here = own + n_ * static_cast<Eigen::Index>(run);
  sums.normal.topLeftCorner(own, own) += normal.topLeftCorner(own, own);
  sums.normal.block(here, here, n_, n_) += normal.block(own, own, n_, n_);
  sums.normal.block(here, 0, n_, own) += normal.block(own, 0, n_, own);
  sums.normal.block(0, here, own, n_) += normal.block(0, own, own, n_);
  sums.gradient.head(own) += gradient.head(own);
  sums.gradient.segment(here, n_) += gradient.segment(own, n_);
}

void TrajectorySystem::join(const std::vector<TrajectoryRun>& runs, const std::vector<TrajectoryRun>& given,
                            const TrajectoryWeights& weights, std::size_t r, bool joined, const State& end,
                            TrajectorySums& sums) const {
  const Eigen::Index own = p_ + delays(), here = own + n_ * static_cast<Eigen::Index>(r);
  for (Eigen::Index k = 0; k < n_; ++k) {
    const double prior = weights.start_prior.size() > 0 ? weights.start_prior[k] : 0;
    if (prior > 0) {
      const double residual = (given[r].start[k] - runs[r].start[k]) * prior;
      sums.objective += residual * residual;
      sums.normal(here + k, here + k) += prior * prior;
      sums.gradient[here + k] += residual * prior;
    }
    const double gap = joined ? weights.gap[k] : 0;
    if (!(gap > 0)) continue;
    const double residual = (runs[r + 1].start[k] - end.x[k]) * gap;
    sums.objective += residual * residual;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(sums.gradient.size());
    row.head(own) = gap * end.s.col(k).head(own);
    row.segment(here, n_) = gap * end.s.col(k).segment(own, n_);
    row[here + n_ + k] -= gap;
    sums.normal.noalias() += row * row.transpose();
    sums.gradient += residual * row;
  }
}

TrajectorySums TrajectorySystem::run(const std::vector<TrajectoryRecord>& records,
                                     const std::vector<TrajectoryRun>& runs, const std::vector<TrajectoryRun>& given,
                                     const TrajectoryWeights& weights) {
  reached_.assign(reached_.size(), {});
  const Eigen::Index own = p_ + delays(), local = own + n_;
  const Eigen::Index total = own + n_ * static_cast<Eigen::Index>(runs.size());
  TrajectorySums sums;
  sums.normal.setZero(total, total);
  sums.gradient.setZero(total);
  sums.cost_of.setZero(q_);
  sums.rows_of.setZero(q_);
  constexpr Eigen::Index batch = 64;
  Eigen::MatrixXd rows(local, batch * std::max<Eigen::Index>(1, q_));
  Eigen::VectorXd residuals(rows.cols());
  State at;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const TrajectoryRun& run = runs[r];
    const TrajectoryRecord& record = records[run.record];
    const bool joined = weights.gap.size() > 0 && r + 1 < runs.size() && runs[r + 1].record == run.record &&
                        runs[r + 1].first == run.first + run.count;
    const Eigen::Index last = run.count + (joined ? 1 : 0);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(local, local);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(local);
    Eigen::Index filled = 0, i = 0;
    const auto flush = [&] {
      if (filled == 0) return;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(rows.leftCols(filled));
      gradient.noalias() += rows.leftCols(filled) * residuals.head(filled);
      filled = 0;
    };
    const auto compare = [&] {
      if (!at.x.allFinite() || at.x.cwiseAbs().maxCoeff() > kFar) return false;
      if (i >= run.count) return true;
      look(record, static_cast<double>(run.first + i), at.x, true);
      for (Eigen::Index o = 0; o < q_; ++o) {
        const double w = weights.output.size() > 0 ? weights.output[o] : 1;
        const double residual = (record.measured(run.first + i, o) - y_[o]) * w;
        if (!std::isfinite(record.measured(run.first + i, o))) continue;
        if (!std::isfinite(residual)) return false;
        sums.cost_of[o] += residual * residual;
        ++sums.rows_of[o];
        rows.col(filled).setZero();
        rows.col(filled).head(own) = w * seen_parameter_.col(o);
        for (Eigen::Index k = 0; k < n_; ++k) {
          if (seen_(o, k) != 0) rows.col(filled) += w * seen_(o, k) * at.s.col(k).head(local);
        }
        residuals[filled++] = residual;
      }
      if (filled + q_ > rows.cols()) flush();
      return true;
    };
    at.x = run.start;
    at.s.setZero(SensitivityStep::rows(local), n_);
    at.s.middleRows(own, n_).setIdentity();
    bool good = true;
    for (const HeldStep& s : held_steps(record.inputs, dead_samples(record.dt), run.first, last, substeps_)) {
      if (s.sample) {
        if (!(good = compare())) break;
        ++i;
      }
      if (s.switched != 0) jump(record, s, at);
      step(record, s, true, at);
    }
    if (!good || !compare()) {
      sums.diverged = true;
      return sums;
    }
    flush();
    normal.triangularView<Eigen::StrictlyUpper>() = normal.transpose();
    add_run(normal, gradient, r, sums);
    join(runs, given, weights, r, joined, at, sums);
  }
  sums.objective += sums.cost();
  return sums;
}

}  // namespace whirl::identification::detail
