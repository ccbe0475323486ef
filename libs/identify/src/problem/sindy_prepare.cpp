#include "problem/sindy_prepare.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"

namespace whirl::identification::detail {
namespace {

const Equation* known_equation(const SindyOptions& o, const std::string& lhs) {
  for (const Equation& e : o.equations.known) {
    if (e.lhs == lhs) return &e;
  }
  return nullptr;
}

Candidates candidate_terms(const SindyOptions& o) {
  Candidates candidates;
  const std::vector<std::string> names = library_names(o);
  const std::vector<expr::Expr> common =
      o.library.empty() ? expr::polynomial_library(names, names.size() > 3 ? 2 : 3) : expr::parse_library(o.library);
  for (const std::string& state : o.states) {
    const std::string lhs = lhs_of(state, o);
    if (known_equation(o, lhs) != nullptr) continue;
    const auto own = o.equations.library_of.find(lhs);
    candidates[lhs] =
        expr::union_library({own == o.equations.library_of.end() ? common : expr::parse_library(own->second)});
  }
  for (const auto& [lhs, terms] : o.equations.library_of) {
    if (!candidates.contains(lhs)) {
      throw Error::in_field("equation with its own library", lhs, "the left-hand side of a sought equation");
    }
  }
  return candidates;
}

void check(const SindyOptions& o) {
  if (o.states.empty()) throw Error("no state named to identify an equation of");
  require_range("order", o.order, 1, 2);
  if (o.discrete && o.order == 2) throw Error("a map has order 1: name delayed channels as inputs");
  require_range("t value", o.search.t_value, 0, 1e6);
  require_range("least share", o.search.least_share, 0, 1);
  require_range("most passes", o.search.max_passes, 1, 1e9);
  if (!o.noise_correlation.empty() && (o.discrete || !o.refine))
    throw Error("a correlation of the noise needs differential equations and refinement");
  for (const auto& [state, correlation] : o.noise_correlation) {
    if (std::find(o.states.begin(), o.states.end(), state) == o.states.end())
      throw Error::in_field("noise correlation", state, "a state");
    require_range("noise correlation of " + state, correlation, 0, 0.99);
  }
}

regression::Problem select_terms(const regression::Problem& all, const std::vector<int>& terms) {
  regression::Problem p;
  const auto pick = [&](const regression::GramBlock& b) {
    return regression::GramBlock{b.gram(terms, terms), b.moment(terms), b.energy, b.rows};
  };
  p.total = pick(all.total);
  for (const regression::GramBlock& b : all.blocks) p.blocks.push_back(pick(b));
  p.effective_rows = all.effective_rows;
  return p;
}

}  // namespace

std::string lhs_of(const std::string& state, const SindyOptions& o) {
  return o.discrete ? state + "[k+1]" : o.order == 2 ? state + "''" : state + "'";
}

SindyData::SindyData(const SindyOptions& options) : options_(options) {
  check(options_);
  candidates_ = candidate_terms(options_);
  signs_ = resolve_signs(options_.equations.signs, candidates_);
  std::vector<std::vector<expr::Expr>> libraries;
  for (const auto& [lhs, terms] : candidates_) libraries.push_back(terms);
  all_ = expr::union_library(libraries);
  std::vector<std::string> names = library_names(options_);
  names.push_back("t");
  tape_ = expr::compile(all_, names);
  energy_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(options_.states.size()));
}

void SindyData::add(const std::vector<Recording>& records, Eigen::Index most) {
  std::vector<Stretch> stretches = finite_stretches(records, options_);
  Eigen::Index added = 0;
  for (const Stretch& s : stretches) added += s.samples();
  if (options_.discrete) {
    for (Stretch& s : stretches) s.smooth = s.raw;
  } else {
    energy_ += static_cast<double>(added) * smooth_stretches(stretches).cwiseAbs2();
    if (samples_ == 0) {
      rate_ = characteristic_rate(stretches);
      half_ = std::lround((options_.search.window > 0 ? options_.search.window : 1 / rate_) / stretches.front().dt);
    }
  }
  samples_ += added;
  sd_ = (energy_ / static_cast<double>(samples_)).cwiseSqrt();
  if (!all_.empty()) accumulate(stretches);
  if (batches_ % keep_every_ == 0) {
    for (Stretch& s : stretches) {
      kept_.push_back(std::move(s));
      batch_of_.push_back(batches_);
    }
  }
  ++batches_;
  const auto held = [&] {
    Eigen::Index n = 0;
    for (const Stretch& s : kept_) n += s.samples();
    return n;
  };
  while (batches_ > 2 && held() > most) {
    keep_every_ *= 2;
    std::size_t out = 0;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      if (batch_of_[i] % keep_every_ != 0) continue;
      if (out != i) {
        kept_[out] = std::move(kept_[i]);
        batch_of_[out] = batch_of_[i];
      }
      ++out;
    }
    kept_.resize(out);
    batch_of_.resize(out);
    if (out == 1) break;
  }
}

void SindyData::accumulate(const std::vector<Stretch>& stretches) {
  const Eigen::Index targets = static_cast<Eigen::Index>(options_.states.size());
  if (!sums_) {
    Eigen::Index rows = 0;
    for (const Stretch& s : stretches) rows += s.samples();
    if (!options_.discrete) rows /= std::max<Eigen::Index>(1, half_ / 3);
    sums_ = std::make_unique<regression::GramAccumulator>(static_cast<Eigen::Index>(all_.size()), targets,
                                                          std::max<Eigen::Index>(2, rows / 40));
  }
  for (const Stretch& s : stretches) {
    const Eigen::MatrixXd columns = tape_.evaluate(library_variables(s, options_));
    if (options_.discrete) {
      const Eigen::Index n = s.samples() - 1;
      sums_->add(columns.topRows(n), s.raw.bottomRows(n));
    } else {
      const IntegralRows r = integral_rows(s, columns, options_.order, half_);
      sums_->add(r.theta, r.target);
    }
    sums_->end_block();
  }
}

void SindyData::finish() const {
  if (samples_ < 50) throw Error::in_field("usable samples", std::to_string(samples_), "at least 50");
}

regression::Problem SindyData::problem(std::size_t state) const {
  const std::vector<expr::Expr>& terms = candidates_.at(lhs_of(options_.states[state], options_));
  std::vector<int> index;
  for (const expr::Expr& e : terms)
    index.push_back(static_cast<int>(std::find(all_.begin(), all_.end(), e) - all_.begin()));
  regression::Problem problem = select_terms(sums_->problem(static_cast<Eigen::Index>(state)), index);
  for (const expr::Expr& e : terms) problem.names.push_back(e.str());
  // Windows overlap three times their stride.
  problem.effective_rows = options_.discrete ? 0 : std::max(10.0, problem.total.rows / 3);
  return problem;
}

Regression regress(const SindyData& data, const regression::SolveOptions& solver_options) {
  const SindyOptions& options = data.options();
  Regression result;
  IdentifiedModel& model = result.model;
  model.method = "sindy";
  model.states = options.states;
  model.inputs = options.inputs;
  model.sample_time = data.stretches().front().dt;
  model.noise_sd = data.noise_sd().mean();
  model.provenance.version = std::string(version());
  if (options.order == 2) {
    for (const std::string& s : options.states) {
      model.states.push_back(s + "'");
      model.equations.push_back({s + "'", {{s + "'", {1, 0, 1, 1}, ""}}});
    }
  }
  for (const auto& [lhs, terms] : data.candidates()) {
    for (const expr::Expr& e : terms) {
      const std::vector<std::string> used = expr::variables(e);
      const bool has = std::find(model.inputs.begin(), model.inputs.end(), "t") != model.inputs.end();
      if (!has && std::find(used.begin(), used.end(), "t") != used.end()) model.inputs.push_back("t");
    }
  }
  model.summary.condition_number = 0;
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const std::string lhs = lhs_of(options.states[k], options);
    if (const Equation* known = known_equation(options, lhs)) {
      model.equations.push_back(*known);
      for (EquationTerm& t : model.equations.back().terms) t.coefficient.sd = 0;
      continue;
    }
    const regression::Problem problem = data.problem(k);
    regression::SolveOptions solver = solver_options;
    if (solver.noise_floor == 0) solver.noise_floor = options.search.least_share;
    if (solver.max_terms == 0 && problem.names.size() > 12) solver.max_terms = 12;
    if (data.signs().contains(lhs)) {
      solver.rules.sign.clear();
      for (const std::string& function : problem.names)
        solver.rules.sign.push_back(sign_of(data.signs(), lhs, function));
    }
    const regression::SparseFit fit = regression::solve(problem, solver);
    for (TermScore& s : blocked_terms(problem, fit, solver.rules.sign, lhs, options.search.t_value))
      result.blocked.push_back(std::move(s));
    const auto name = [&](Eigen::Index j) { return problem.names[static_cast<std::size_t>(j)]; };
    Equation equation{lhs, {}};
    for (int j : fit.support) equation.terms.push_back({name(j), Estimate::from_sd(fit.xi[j], fit.sd[j]), ""});
    for (const regression::PathPoint& point : fit.path) {
      if (point.terms == 0 || point.terms > 12) continue;
      Equation other{lhs, {}};
      for (Eigen::Index j = 0; j < point.xi.size(); ++j) {
        Estimate guess;
        guess.value = point.xi[j];
        if (guess.value != 0) other.terms.push_back({name(j), guess, ""});
      }
      result.alternatives.push_back(std::move(other));
    }
    model.equations.push_back(std::move(equation));
    model.summary.condition_number = std::fmax(model.summary.condition_number, fit.summary.condition_number);
    if (fit.summary.residual > result.least.residual) result.least = {lhs, fit.summary.residual};
    for (const std::string& w : fit.summary.warnings) model.summary.warn(lhs + ": " + w);
  }
  model.summary.residual = result.least.residual;
  return result;
}

}  // namespace whirl::identification::detail
