#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "evidence/channel_units.hpp"
#include "evidence/record_quality.hpp"
#include "rules/rules.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "trajectory/trajectory_score.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/rational.hpp"
#include "whirl/identify/trajectory.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification {
namespace {

using expr::Expr;

/// Numerator and denominator of one equation: indices into the candidates, with values.
struct Quotient {
  std::map<std::size_t, double> above, below;
  std::size_t size() const { return above.size() + below.size(); }
  bool operator<(const Quotient& o) const {
    const auto keys = [](const std::map<std::size_t, double>& m) {
      std::vector<std::size_t> k;
      for (const auto& [i, v] : m) k.push_back(i);
      return k;
    };
    return std::pair(keys(above), keys(below)) < std::pair(keys(o.above), keys(o.below));
  }
};

/// One free fit: values back in the quotients, with what the score test says of absent terms.
struct Fit {
  std::vector<Quotient> equations;
  TrajectoryFit trajectory;
  double bic = INFINITY;
};

class Rational {
 public:
  Rational(const std::vector<Recording>& records, const SindyOptions& o) : options_(o) {
    if (o.order != 1 || o.discrete) throw Error("rational right-hand sides are for --order 1");
    std::vector<std::string> texts = o.library;
    above_ = expr::parse_library(texts);
    below_ = expr::parse_library(o.equations.denominators);
    std::erase_if(below_, [](const Expr& e) { return e.is_number(); });
    if (above_.empty() || below_.empty()) throw Error("rational: numerator and denominator need candidate terms");
    names_ = library_names();
    std::vector<detail::Stretch> stretches = detail::finite_stretches(records, o);
    sd_ = detail::smooth_stretches(stretches);
    for (Eigen::Index k = 0; k < sd_.size(); ++k) {
      double sum = 0, rows = 0;
      for (const detail::Stretch& s : stretches) {
        sum += s.raw.col(k).squaredNorm();
        rows += static_cast<double>(s.samples());
      }
      sd_[k] = std::max(sd_[k], 1e-6 * std::sqrt(sum / rows));
    }
    rate_ = detail::characteristic_rate(stretches);
    runs_ = detail::runs_of(o, stretches);
    regress(stretches);
  }

  /// Supports that the rows of one equation like, smallest first.
  std::vector<Quotient> supports(std::size_t state) const {
    std::vector<Quotient> out;
    std::set<Quotient> seen;
    for (const Eigen::VectorXd& xi : paths_[state]) {
      Quotient q;
      for (Eigen::Index j = 0; j < xi.size(); ++j) {
        if (xi[j] == 0) continue;
        const auto i = static_cast<std::size_t>(j);
        (i < above_.size() ? q.above[i] : q.below[i - above_.size()]) = xi[j];
      }
      if (!q.above.empty() && seen.insert(q).second) out.push_back(q);
    }
    return out;
  }

  Fit fit(const std::vector<Quotient>& equations, Eigen::Index length, int iterations, bool score) const {
    TrajectoryModel model;
    model.states = options_.states;
    model.inputs = options_.inputs;
    TrajectoryOptions o;
    o.output_sd = sd_;
    o.max_iterations = iterations;
    for (std::size_t s = 0; s < equations.size(); ++s) {
      std::vector<Expr> above, below{Expr(1)};
      const auto add = [&](const char* kind, std::size_t i, const Expr& term, double value, std::vector<Expr>& into) {
        const std::string name = fmt::format("_{}{}_{}", kind, s, i);
        model.parameters.push_back({name, value});
        into.push_back(Expr::symbol(name) * term);
        return name;
      };
      for (const auto& [i, v] : equations[s].above) add("n", i, above_[i], v, above);
      for (const auto& [i, v] : equations[s].below) add("d", i, below_[i], v, below);
      if (score) {
        for (std::size_t i = 0; i < above_.size(); ++i) {
          if (!equations[s].above.contains(i)) o.scored.push_back(add("n", i, above_[i], 0, above));
        }
        for (std::size_t i = 0; i < below_.size(); ++i) {
          if (!equations[s].below.contains(i)) o.scored.push_back(add("d", i, below_[i], 0, below));
        }
      }
      model.rates.push_back(Expr::sum(above) / Expr::sum(below));
      model.channels.push_back(options_.states[s]);
      model.outputs.push_back(Expr::symbol(options_.states[s]));
    }
    Fit out{equations, fit_trajectory(model, runs_.records, detail::cut_trajectory_runs(runs_, length, 20000), o)};
    if (out.trajectory.diverged) return out;
    for (const TrajectoryParameter& p : out.trajectory.model.parameters) {
      std::size_t s = 0, i = 0;
      place(p.name, s, i);
      std::map<std::size_t, double>& values = p.name[1] == 'n' ? out.equations[s].above : out.equations[s].below;
      if (values.contains(i)) values[i] = p.value;
    }
    if (!score && has_pole(out.equations)) return out;
    double terms = 0;
    for (const Quotient& q : equations) terms += static_cast<double>(q.size());
    const double rows = static_cast<double>(out.trajectory.rows);
    out.bic = rows * std::log(std::max(out.trajectory.cost / rows, 1e-30)) + std::log(rows) * terms;
    return out;
  }

  /// Drops and adds terms until neither changes.
  Fit settle(Fit now, Eigen::Index length) const {
    std::set<std::string> refused;
    for (int pass = 0; pass < 40; ++pass) {
      now = fit(now.equations, length, 30, false);
      if (!std::isfinite(now.bic)) return now;
      double least = options_.search.t_value;
      std::string weakest;
      for (std::size_t k = 0; k < now.trajectory.model.parameters.size(); ++k) {
        const TrajectoryParameter& p = now.trajectory.model.parameters[k];
        const auto j = static_cast<Eigen::Index>(k);
        const double t = std::abs(p.value) / std::sqrt(now.trajectory.covariance(j, j));
        if (!(t < least)) continue;
        least = t;
        weakest = p.name;
      }
      if (!weakest.empty()) {
        erase(now.equations, weakest);
        refused.insert(weakest);
        continue;
      }
      const Fit scored = fit(now.equations, length, 1, true);
      const TrajectoryScore* best = nullptr;
      for (const TrajectoryScore& s : scored.trajectory.scores) {
        if (best == nullptr && !refused.contains(s.name) &&
            s.score >= options_.search.t_value * options_.search.t_value)
          best = &s;
      }
      if (best == nullptr) return now;
      std::vector<Quotient> larger = now.equations;
      std::size_t s = 0, i = 0;
      place(best->name, s, i);
      (best->name[1] == 'n' ? larger[s].above : larger[s].below)[i] = 0.3 * best->step;
      const Fit trial = fit(larger, length, 30, false);
      refused.insert(best->name);
      if (trial.bic < now.bic) now = trial;
    }
    return now;
  }

  std::vector<std::vector<Quotient>> starts() const {
    std::vector<std::vector<Quotient>> all;
    for (std::size_t s = 0; s < options_.states.size(); ++s) all.push_back(supports(s));
    return all;
  }
  Eigen::Index period() const {
    return std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / rate_ / runs_.records.front().dt));
  }
  Eigen::Index longest() const {
    Eigen::Index n = 0;
    for (const Recording& r : runs_.records) n = std::max(n, r.size());
    return n;
  }

  void describe(const Fit& fit, IdentifiedModel& model) const {
    std::size_t k = 0;
    const auto next = [&] {
      const auto j = static_cast<Eigen::Index>(k);
      const Estimate e =
          Estimate::from_sd(fit.trajectory.model.parameters[k].value, std::sqrt(fit.trajectory.covariance(j, j)));
      ++k;
      return e;
    };
    for (std::size_t s = 0; s < fit.equations.size(); ++s) {
      const std::string lhs = options_.states[s] + "'";
      std::vector<Expr> below{Expr(1)};
      for (const auto& [i, v] : fit.equations[s].below) below.push_back(Expr(v) * below_[i]);
      Equation e{lhs, {}};
      for (const auto& [i, v] : fit.equations[s].above) {
        e.terms.push_back({(above_[i] / Expr::sum(below)).str(), next(), ""});
        model.parameters.emplace_back(lhs + ": " + above_[i].str(), e.terms.back().coefficient);
      }
      for (const auto& [i, v] : fit.equations[s].below)
        model.parameters.emplace_back(lhs + " denominator: " + below_[i].str(), next());
      model.equations.push_back(std::move(e));
    }
    const auto n = static_cast<Eigen::Index>(model.parameters.size());
    const Eigen::MatrixXd covariance = fit.trajectory.covariance.topLeftCorner(n, n);
    model.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
    model.sample_time = runs_.records.front().dt;
    model.noise_sd = sd_.mean();
  }

 private:
  /// Does a denominator change sign within the records? A zero of the numerator beside it hides it from free runs.
  bool has_pole(const std::vector<Quotient>& equations) const {
    for (const Quotient& q : equations) {
      Eigen::VectorXd d = Eigen::VectorXd::Ones(below_values_.rows());
      for (const auto& [i, v] : q.below) d += v * below_values_.col(static_cast<Eigen::Index>(i));
      if (!(d.minCoeff() > 0)) return true;
    }
    return false;
  }
  std::vector<std::string> library_names() const {
    std::vector<std::string> names = options_.states;
    names.insert(names.end(), options_.inputs.begin(), options_.inputs.end());
    names.emplace_back("t");
    return names;
  }
  static void place(const std::string& name, std::size_t& state, std::size_t& term) {
    const auto bar = name.find('_', 1);
    state = std::stoul(name.substr(2, bar - 2));
    term = std::stoul(name.substr(bar + 1));
  }
  static void erase(std::vector<Quotient>& equations, const std::string& name) {
    std::size_t s = 0, i = 0;
    place(name, s, i);
    (name[1] == 'n' ? equations[s].above : equations[s].below).erase(i);
  }

  /// Best subsets of the implicit rows of every equation, by size.
  void regress(const std::vector<detail::Stretch>& stretches) {
    std::vector<Expr> all = above_;
    all.insert(all.end(), below_.begin(), below_.end());
    const expr::Tape tape = expr::compile(all, names_);
    const auto terms = static_cast<Eigen::Index>(all.size()), n = static_cast<Eigen::Index>(above_.size());
    for (std::size_t s = 0; s < options_.states.size(); ++s) {
      regression::GramAccumulator sums(terms, 1);
      for (const detail::Stretch& stretch : stretches) {
        Eigen::MatrixXd variables(stretch.samples(), static_cast<Eigen::Index>(names_.size()));
        variables << stretch.smooth, stretch.inputs,
            Eigen::VectorXd::LinSpaced(stretch.samples(), stretch.t0,
                                       stretch.t0 + stretch.dt * static_cast<double>(stretch.samples() - 1));
        Eigen::MatrixXd theta = tape.evaluate(variables);
        if (s == 0) {
          const Eigen::Index before = below_values_.rows();
          below_values_.conservativeResize(before + theta.rows(), terms - n);
          below_values_.bottomRows(theta.rows()) = theta.rightCols(terms - n);
        }
        const Eigen::VectorXd rate = stretch.rate.col(static_cast<Eigen::Index>(s));
        for (Eigen::Index j = n; j < terms; ++j) theta.col(j).array() *= -rate.array();
        const Eigen::Index cut = std::min<Eigen::Index>(5, stretch.samples() / 10);
        sums.add(theta.middleRows(cut, stretch.samples() - 2 * cut), rate.segment(cut, stretch.samples() - 2 * cut));
      }
      regression::SolveOptions solver;
      solver.method = "best_subset";
      solver.selection = regression::Selection::bic;
      solver.max_terms = std::min<int>(8, static_cast<int>(terms));
      std::vector<Eigen::VectorXd> path;
      for (const regression::PathPoint& p : regression::solve(sums.problem(0), solver).path) path.push_back(p.xi);
      paths_.push_back(std::move(path));
    }
  }

  const SindyOptions& options_;
  std::vector<Expr> above_, below_;
  std::vector<std::string> names_;
  Eigen::VectorXd sd_;
  Eigen::MatrixXd below_values_;  // candidates of the denominator at every sample
  double rate_ = 0;
  detail::RunRecords runs_;
  std::vector<std::vector<Eigen::VectorXd>> paths_;
};

}  // namespace

IdentifiedModel fit_rational(const std::vector<Recording>& records, const SindyOptions& options) {
  IdentifiedModel model;
  model.method = "sindy";
  model.states = options.states;
  model.inputs = options.inputs;
  model.provenance.version = std::string(version());
  for (const Recording& r : records) model.provenance.inputs.push_back(r.source);
  detail::check_signals(records, options.states, options.inputs, false, model.summary);
  if (model.summary.status == Status::unusable) {
    model.summary.trust = "Do not use this model.";
    return model;
  }
  const Rational rational(records, options);
  const Eigen::Index length = std::min(rational.longest(), 3 * rational.period());
  // Equation by equation the support whose free runs are likeliest, beginning with middling ones.
  const std::vector<std::vector<Quotient>> starts = rational.starts();
  std::vector<Quotient> now;
  for (const std::vector<Quotient>& of : starts) {
    if (of.empty()) throw Error("rational: no candidate term explains an equation");
    now.push_back(of[std::min<std::size_t>(of.size() - 1, 2)]);
  }
  Fit best = rational.fit(now, length, 15, false);
  for (int round = 0; round < (now.size() > 1 ? 2 : 1); ++round) {
    for (std::size_t s = 0; s < starts.size(); ++s) {
      for (const Quotient& q : starts[s]) {
        std::vector<Quotient> trial = best.equations;
        trial[s] = q;
        Fit f = rational.fit(trial, length, 15, false);
        if (f.bic < best.bic) best = std::move(f);
      }
    }
  }
  if (std::isfinite(best.bic)) best = rational.settle(std::move(best), length);
  if (std::isfinite(best.bic) && rational.longest() > length) {
    Fit whole = rational.settle(best, rational.longest());
    if (std::isfinite(whole.bic) && whole.trajectory.rmse < 1.2 * best.trajectory.rmse) best = std::move(whole);
  }
  if (!std::isfinite(best.bic)) {
    model.summary.fail("free runs of every quotient tried diverge");
    model.summary.trust = "Do not use this model.";
    return model;
  }
  rational.describe(best, model);
  detail::set_coefficient_units(model, records.front());
  Summary& s = model.summary;
  s.chi_square = best.trajectory.rmse * best.trajectory.rmse;
  s.residual = best.trajectory.rmse;
  if (!best.trajectory.converged) s.warn("the fit on free runs did not converge");
  if (s.chi_square > rules::kModelError)
    s.warn(fmt::format("model error: chi-square {:.2f} (1 when the model fits)", s.chi_square));
  s.trust = "Trust free runs in the range of the records; where a denominator nears zero beyond it they mean nothing.";
  return model;
}

}  // namespace whirl::identification
