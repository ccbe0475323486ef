#include "output_error/term_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "output_error/model_terms.hpp"
#include "output_error/substeps.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification::detail {

TermSearch::TermSearch(const IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
                       const std::vector<Stretch>& stretches, const Eigen::VectorXd& sd, double characteristic_rate,
                       const SindyOptions& options)
    : candidates_(candidates),
      signs_(signs),
      stretches_(stretches),
      options_(options),
      compiled_(model),
      shares_(candidates, stretches, options),
      dt_(stretches.front().dt) {
  refine_.outputs = options.states;
  refine_.output_sd = sd;
  refine_.output_correlation = noise_correlations(options);
  refine_.max_iterations = 20;
  refine_.tolerance = 1e-5;
  length_ = std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / characteristic_rate / dt_));
  runs_ = cut(steps_);
}

bool TermSearch::take_finer_steps(IdentifiedModel& model) {
  if (compiled_.inputs().empty() || steps_ >= kMostSteps || coarse_suits_) return false;
  const auto cut_at = [&](int steps) {
    std::vector<FreeRun> runs = cut(steps);
    for (std::size_t k = 0; k < runs.size(); ++k) runs[k].start = runs_[k].start;
    return runs;
  };
  const FinerSteps found = finer_steps(model, cut_at, steps_, dt_, refine_);
  passes_ += found.passes;
  coarse_suits_ = found.against;
  if (found.steps == steps_) return false;
  steps_ = found.steps;
  runs_ = cut(steps_);
  take(model, found.fit);
  return true;
}

TermSearch::Outcome TermSearch::settle(IdentifiedModel& model) {
  std::set<std::string> rejected;
  std::string added;
  // Terms that are far from needed show after a few steps; the last word has the converged model.
  RefineOptions coarse = refine_;
  coarse.max_iterations = 3;
  coarse.tolerance = 1e-3;
  const auto drop_weak = [&] {
    std::vector<Weak> weak = weak_terms(model, shares_, signs_, options_);
    if (weak.empty()) return false;
    for (const Weak& w : weak) {
      const std::string name = model.equations[w.equation].lhs + model.equations[w.equation].terms[w.term].function;
      if (name == added) rejected.insert(name);
    }
    weak.resize((weak.size() + 1) / 2);
    drop(model, weak);
    return true;
  };
  bool begun = false;
  while (!spent()) {
    const Refined quick = refined(model, coarse);
    if (quick.starts.empty()) return Outcome::diverged;
    take(model, quick);
    if (!begun) take_finer_steps(model);
    begun = true;
    if (drop_weak()) continue;
    const Refined full = refined(model, refine_, absent_terms(model, candidates_));
    if (full.starts.empty()) return Outcome::diverged;
    take(model, full);
    followed_.information = full.information;
    followed_.gradient = full.gradient;
    if (drop_weak()) continue;
    added = add_best(model, full, rejected);
    if (!added.empty()) continue;
    if (drop_jointly(model, full.covariance, rejected) || take_finer_steps(model)) continue;
    return Outcome::settled;
  }
  return Outcome::stopped;
}

bool TermSearch::lengthen(IdentifiedModel& model) {
  const bool whole =
      std::all_of(stretches_.begin(), stretches_.end(), [&](const Stretch& s) { return s.samples() < 2 * length_; });
  if (whole || spent()) return false;
  const Eigen::Index length = length_;
  return attempt(model, [&](IdentifiedModel& trial) {
    const double variance = square(followed_.rmse);
    set_length(4 * length);
    RefineOptions few = refine_;
    few.max_iterations = 4;
    const Refined probe = refined(trial, few);
    if (probe.starts.empty() || square(probe.rmse) > 1.5 * variance) return false;
    take(trial, probe);
    return settle(trial) == Outcome::settled && followed_.converged && square(followed_.rmse) <= 1.2 * variance;
  });
}

Refined TermSearch::refined(const IdentifiedModel& model, const RefineOptions& options,
                            const std::vector<Equation>& candidates) {
  Refined result = refine_free_run(model, runs_, dt_, options, candidates);
  passes_ += result.passes;
  return result;
}

void TermSearch::take(IdentifiedModel& model, const Refined& refined) {
  model.equations = refined.model.equations;
  followed_ = {refined.output_rmse,
               refined.output_rows,
               refined.autocorrelation,
               refined.covariance,
               refined.rmse,
               refined.converged,
               {},
               {},
               {}};
  for (std::size_t k = 0; k < runs_.size(); ++k) runs_[k].start = refined.starts[k];
}

bool TermSearch::attempt(IdentifiedModel& model, const std::function<bool(IdentifiedModel&)>& change) {
  IdentifiedModel trial = model;
  const Fit fit = followed_;
  const Eigen::Index length = length_;
  const std::vector<FreeRun> runs = runs_;
  const int steps = steps_;
  const bool kept = change(trial);
  if (kept) {
    model = std::move(trial);
  } else {
    followed_ = fit;
    length_ = length;
    runs_ = runs;
    steps_ = steps;
  }
  return kept;
}

double TermSearch::samples() const {
  Eigen::Index n = 0;
  for (const FreeRun& r : runs_) n += r.measured.size();
  return static_cast<double>(n);
}

bool TermSearch::drop_jointly(IdentifiedModel& model, const Eigen::MatrixXd& covariance,
                              std::set<std::string>& rejected) const {
  constexpr Eigen::Index most_terms = 40;
  const Eigen::Index p = covariance.rows();
  if (p < 2 || p > most_terms) return false;
  std::vector<Weak> places;
  Eigen::VectorXd theta(p);
  for (std::size_t e = 0; e < model.equations.size(); ++e) {
    for (std::size_t t = 0; t < model.equations[e].terms.size(); ++t) {
      const Estimate& c = model.equations[e].terms[t].coefficient;
      if (c.sd == 0) continue;
      theta[static_cast<Eigen::Index>(places.size())] = c.value;
      places.push_back({e, t, 0});
    }
  }
  const Eigen::VectorXd unit = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd correlation = unit.cwiseInverse().asDiagonal() * covariance * unit.cwiseInverse().asDiagonal();
  regression::Problem wald;
  wald.total.gram = correlation.ldlt().solve(Eigen::MatrixXd::Identity(p, p));
  const Eigen::VectorXd t = theta.cwiseQuotient(unit);
  wald.total.moment = wald.total.gram * t;
  wald.total.energy = t.dot(wald.total.moment);
  wald.total.rows = 1;
  if (!wald.total.gram.allFinite() || !(wald.total.energy > 0)) return false;
  wald.effective_rows = samples();
  const regression::SparseFit fit = regression::solve(wald, {.method = "best_subset"});
  const double price = options_.search.t_value * options_.search.t_value;
  const regression::PathPoint* best = nullptr;
  for (const regression::PathPoint& point : fit.path) {
    if (best == nullptr || point.rss + price * point.terms < best->rss + price * best->terms) best = &point;
  }
  if (best == nullptr || best->terms >= p) return false;
  std::vector<Weak> out;
  for (Eigen::Index j = 0; j < p; ++j) {
    if (best->xi[j] != 0) continue;
    const Weak& w = places[static_cast<std::size_t>(j)];
    out.push_back(w);
    rejected.insert(model.equations[w.equation].lhs + model.equations[w.equation].terms[w.term].function);
  }
  drop(model, out);
  return true;
}

std::string TermSearch::add_best(IdentifiedModel& model, const Refined& scored, const std::set<std::string>& rejected) {
  for (const TermScore& s : scored.scores) {
    if (s.score < options_.search.t_value * options_.search.t_value) break;
    const auto equation = std::find_if(model.equations.begin(), model.equations.end(),
                                       [&](const Equation& e) { return e.lhs == s.equation; });
    const double total = shares_.of(*equation);
    if (total > 0 && std::abs(s.coefficient) * shares_.of(s.function) < options_.search.least_share * total) continue;
    if (sign_of(signs_, s.equation, s.function) * s.coefficient < 0) {
      followed_.blocked.push_back(s);
      continue;
    }
    if (rejected.contains(s.equation + s.function)) continue;
    Estimate start;
    start.value = s.coefficient;
    equation->terms.push_back({s.function, start, ""});
    return s.equation + s.function;
  }
  return "";
}

}  // namespace whirl::identification::detail
