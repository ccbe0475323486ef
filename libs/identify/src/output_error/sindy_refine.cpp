#include "output_error/sindy_refine.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "output_error/substeps.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification::detail {
namespace {

struct Weak {
  std::size_t equation, term;
  double worth;  // below 1: to be dropped
};

/// Terms below the limits or across their sign bound, least worth first.
std::vector<Weak> weak_terms(const IdentifiedModel& model, const Shares& shares, const Signs& signs,
                             const SindyOptions& options) {
  std::vector<Weak> weak;
  for (std::size_t e = 0; e < model.equations.size(); ++e) {
    const double total = shares.of(model.equations[e]);
    for (std::size_t t = 0; t < model.equations[e].terms.size(); ++t) {
      const EquationTerm& term = model.equations[e].terms[t];
      const Estimate& c = term.coefficient;
      if (c.sd == 0) continue;  // known
      const double share = total > 0 ? std::abs(c.value) * shares.of(term.function) / total : 0;
      const bool crosses = sign_of(signs, model.equations[e].lhs, term.function) * c.value < 0;
      const double worth =
          crosses ? -1 : std::min(std::abs(c.value) / c.sd / options.t_value, share / options.least_share);
      if (!(worth >= 1)) weak.push_back({e, t, worth});
    }
  }
  std::sort(weak.begin(), weak.end(), [](const Weak& a, const Weak& b) { return a.worth < b.worth; });
  return weak;
}

void drop(IdentifiedModel& model, std::vector<Weak> weak) {
  std::sort(weak.begin(), weak.end(), [](const Weak& a, const Weak& b) { return a.term > b.term; });
  for (const Weak& w : weak) {
    auto& terms = model.equations[w.equation].terms;
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(w.term));
  }
}

std::vector<Equation> absent_terms(const IdentifiedModel& model, const Candidates& candidates) {
  std::vector<Equation> out;
  for (const Equation& e : model.equations) {
    const auto at = candidates.find(e.lhs);
    if (at == candidates.end()) continue;
    Equation absent{e.lhs, {}};
    for (const expr::Expr& c : at->second) {
      const std::string text = c.str();
      const bool present =
          std::any_of(e.terms.begin(), e.terms.end(), [&](const EquationTerm& t) { return t.function == text; });
      if (!present) absent.terms.push_back({text, {}, ""});
    }
    out.push_back(std::move(absent));
  }
  return out;
}

bool within(const Equation& small, const Equation& large) {
  return std::all_of(small.terms.begin(), small.terms.end(), [&](const EquationTerm& a) {
    return std::any_of(large.terms.begin(), large.terms.end(),
                       [&](const EquationTerm& b) { return a.function == b.function; });
  });
}

class Selector {
 public:
  Selector(const IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
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
    refine_.max_iterations = 20;
    refine_.tolerance = 1e-5;
    length_ = std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / characteristic_rate / dt_));
    runs_ = cut(steps_);
  }

  enum class Outcome { settled, diverged, stopped };

  /// Driven systems: more steps a sample where the records ask for them. True when there are.
  bool take_finer_steps(IdentifiedModel& model) {
    if (options_.inputs.empty() || steps_ >= kMostSteps || coarse_suits_) return false;
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

  /// Drops and adds terms until neither changes. `diverged`: free runs of the model do; `stopped`: no passes are left.
  Outcome settle(IdentifiedModel& model) {
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
      if (drop_weak()) continue;
      added = add_best(model, full, rejected);
      if (!added.empty()) continue;
      if (drop_jointly(model, full.covariance, rejected) || take_finer_steps(model)) continue;
      return Outcome::settled;
    }
    return Outcome::stopped;
  }
  bool spent() const { return passes_ >= options_.max_passes; }

  /// Shorter runs forgive a poor model. False when they are short already.
  bool shorten() {
    if (length_ <= 10) return false;
    set_length(length_ / 2);
    return true;
  }

  /// Four times longer runs hold more information: fewer starts to estimate, slow and nearly dependent terms told
  /// apart. Kept while the free run still follows (chaos and model error end it). False when it was not.
  bool lengthen(IdentifiedModel& model) {
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

  /// Tries another right-hand side of one equation; keeps it when the criterion of the free runs falls. False when it
  /// did not, or the terms then did not settle.
  bool exchange(IdentifiedModel& model, const Equation& other) {
    const auto at = static_cast<std::size_t>(std::find_if(model.equations.begin(), model.equations.end(),
                                                          [&](const Equation& e) { return e.lhs == other.lhs; }) -
                                             model.equations.begin());
    const Equation& present = model.equations[at];
    // Every term of the present model is needed already: a part of it cannot do.
    if (spent() || other.terms.size() > present.terms.size() || within(other, present)) return false;
    return attempt(model, [&](IdentifiedModel& trial) {
      trial.equations[at] = other;
      RefineOptions few = refine_;
      few.max_iterations = 2;
      Refined found = refined(trial, few);
      // A hopeless support shows at once.
      if (found.starts.empty() || square(found.rmse) > 4 * square(followed_.rmse)) return false;
      few.max_iterations = 6;
      found = refined(found.model, few);
      const double rows = samples();
      const double now =
          rows * std::log(square(followed_.rmse)) + std::log(rows) * static_cast<double>(present.terms.size());
      const double then =
          rows * std::log(square(found.rmse)) + std::log(rows) * static_cast<double>(other.terms.size());
      if (then >= now) return false;
      take(trial, found);
      return settle(trial) == Outcome::settled;
    });
  }

  double rmse() const { return followed_.rmse; }
  bool converged() const { return followed_.converged; }
  Followed followed() const {
    return {dt_ * static_cast<double>(length_), followed_.output_rmse, followed_.covariance, followed_.blocked,
            steps_ > 1};
  }

 private:
  static constexpr Eigen::Index kMostSamples = 20000;
  static constexpr int kMostSteps = 16;

  struct Fit {
    Eigen::VectorXd output_rmse;
    Eigen::MatrixXd covariance;
    double rmse = 0;
    bool converged = false;
    std::vector<TermScore> blocked;
  };
  static double square(double x) { return x * x; }

  Refined refined(const IdentifiedModel& model, const RefineOptions& options,
                  const std::vector<Equation>& candidates = {}) {
    Refined result = refine_free_run(model, runs_, dt_, options, candidates);
    passes_ += result.passes;
    return result;
  }
  void take(IdentifiedModel& model, const Refined& refined) {
    model.equations = refined.model.equations;
    followed_ = {refined.output_rmse, refined.covariance, refined.rmse, refined.converged, {}};
    for (std::size_t k = 0; k < runs_.size(); ++k) runs_[k].start = refined.starts[k];
  }
  std::vector<FreeRun> cut(int steps) const {
    return cut_runs(compiled_, stretches_, options_, length_, kMostSamples, steps);
  }
  void set_length(Eigen::Index length) {
    length_ = length;
    runs_ = cut(steps_);
  }
  /// Applies `change` to a copy; all is as before when it returns false.
  bool attempt(IdentifiedModel& model, const std::function<bool(IdentifiedModel&)>& change) {
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
  double samples() const {
    Eigen::Index n = 0;
    for (const FreeRun& r : runs_) n += r.measured.size();
    return static_cast<double>(n);
  }
  /// Drops several terms at once when together they lower the error by less than t_value^2 each: nearly dependent terms
  /// can each look significant beside the other. Exact on the quadratic approximation (Wald): a best-subset problem
  /// whose Gram matrix is the information matrix.
  bool drop_jointly(IdentifiedModel& model, const Eigen::MatrixXd& covariance, std::set<std::string>& rejected) const {
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
    const Eigen::MatrixXd correlation =
        unit.cwiseInverse().asDiagonal() * covariance * unit.cwiseInverse().asDiagonal();
    regression::Problem wald;
    wald.total.gram = correlation.ldlt().solve(Eigen::MatrixXd::Identity(p, p));
    const Eigen::VectorXd t = theta.cwiseQuotient(unit);
    wald.total.moment = wald.total.gram * t;
    wald.total.energy = t.dot(wald.total.moment);
    wald.total.rows = 1;
    if (!wald.total.gram.allFinite() || !(wald.total.energy > 0)) return false;
    wald.effective_rows = samples();
    const regression::SparseFit fit = regression::solve(wald, {.method = "best_subset"});
    const double price = options_.t_value * options_.t_value;
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

  /// Adds the absent term with the largest score and tells its name; empty when none is significant. A sign bound in
  /// its way is noted.
  std::string add_best(IdentifiedModel& model, const Refined& scored, const std::set<std::string>& rejected) {
    for (const TermScore& s : scored.scores) {
      if (s.score < options_.t_value * options_.t_value) break;
      const auto equation = std::find_if(model.equations.begin(), model.equations.end(),
                                         [&](const Equation& e) { return e.lhs == s.equation; });
      const double total = shares_.of(*equation);
      if (total > 0 && std::abs(s.coefficient) * shares_.of(s.function) < options_.least_share * total) continue;
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

  const Candidates& candidates_;
  const Signs& signs_;
  const std::vector<Stretch>& stretches_;
  const SindyOptions& options_;
  CompiledModel compiled_;
  Shares shares_;
  double dt_;
  RefineOptions refine_;
  Eigen::Index length_ = 0;
  int steps_ = 1;              // a sample, of driven systems
  bool coarse_suits_ = false;  // the records speak for the steps there are
  std::vector<FreeRun> runs_;
  Fit followed_;
  int passes_ = 0;
};

}  // namespace

Followed refine_and_select(IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
                           const std::vector<Equation>& alternatives, const std::vector<Stretch>& stretches,
                           const Eigen::VectorXd& sd, double characteristic_rate, const SindyOptions& options) {
  Selector selector(model, candidates, signs, stretches, sd, characteristic_rate, options);
  const IdentifiedModel start = model;
  Selector::Outcome outcome = selector.settle(model);
  while (outcome == Selector::Outcome::diverged) {
    model = start;
    if (!selector.shorten()) return {};
    outcome = selector.settle(model);
  }
  if (outcome == Selector::Outcome::stopped) {
    model.summary.fail(fmt::format("after {} passes over the free runs terms still come and go", options.max_passes));
    for (Equation& e : model.equations) {
      std::erase_if(e.terms,
                    [&](const EquationTerm& t) { return sign_of(signs, e.lhs, t.function) * t.coefficient.value < 0; });
    }
  }
  while (selector.lengthen(model)) {
  }
  for (const Equation& other : alternatives) selector.exchange(model, other);
  if (selector.spent() && outcome == Selector::Outcome::settled) {
    model.summary.warn(
        fmt::format("the trial of other terms was cut short after {} passes over the free runs", options.max_passes));
  }
  if (!selector.converged()) model.summary.warn("the refinement on free runs did not converge");
  // Weighted residuals have variance 1 when only the estimated noise is left.
  model.summary.chi_square = selector.rmse() * selector.rmse();
  model.summary.residual = selector.rmse();
  return selector.followed();
}

}  // namespace whirl::identification::detail
