#include "whirl/sindy/sindy.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "channel_units.hpp"
#include "integral_rows.hpp"
#include "sindy_refine.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl {
namespace {

std::string lhs_of(const std::string& state, const SindyOptions& o) {
  return o.discrete ? state + "[k+1]" : o.order == 2 ? state + "''" : state + "'";
}

const Equation* known_equation(const SindyOptions& o, const std::string& lhs) {
  for (const Equation& e : o.known) {
    if (e.lhs == lhs) return &e;
  }
  return nullptr;
}

detail::Candidates candidate_terms(const SindyOptions& o) {
  detail::Candidates candidates;
  const std::vector<std::string> names = detail::library_names(o);
  const std::vector<Expr> common =
      o.library.empty() ? polynomial_library(names, names.size() > 3 ? 2 : 3) : parse_library(o.library);
  for (const std::string& state : o.states) {
    const std::string lhs = lhs_of(state, o);
    if (known_equation(o, lhs) != nullptr) continue;
    const auto own = o.library_of.find(lhs);
    candidates[lhs] = union_library({own == o.library_of.end() ? common : parse_library(own->second)});
  }
  for (const auto& [lhs, terms] : o.library_of) {
    if (!candidates.contains(lhs)) {
      throw Error::in_field("equation with its own library", lhs, "the left-hand side of a sought equation");
    }
  }
  return candidates;
}

void check(const std::vector<Recording>& records, const SindyOptions& o) {
  if (records.empty()) throw Error("no record to identify from");
  if (o.states.empty()) throw Error("no state named to identify an equation of");
  require_range("order", o.order, 1, 2);
  if (o.discrete && o.order == 2) throw Error("a map has order 1: name delayed channels as inputs");
  require_range("t value", o.t_value, 0, 1e6);
  require_range("least share", o.least_share, 0, 1);
  for (const Recording& r : records) {
    if (std::abs(r.dt - records.front().dt) > 1e-9 * r.dt) {
      throw Error(fmt::format("{}: sample time {:g} s, {:g} s in the first record: must be equal", r.source, r.dt,
                              records.front().dt));
    }
  }
}

/// Rows of the regression of all sought equations, one target per state.
GramAccumulator accumulate(const std::vector<detail::Stretch>& stretches, const std::vector<Expr>& terms,
                           const SindyOptions& o, Eigen::Index half) {
  std::vector<std::string> names = detail::library_names(o);
  names.push_back("t");
  const Tape tape = compile(terms, names);
  const Eigen::Index targets = static_cast<Eigen::Index>(o.states.size());
  Eigen::Index rows = 0;
  for (const detail::Stretch& s : stretches) rows += s.samples();
  if (!o.discrete) rows /= std::max<Eigen::Index>(1, half / 3);
  GramAccumulator sums(static_cast<Eigen::Index>(terms.size()), targets, std::max<Eigen::Index>(2, rows / 40));
  for (const detail::Stretch& s : stretches) {
    const Eigen::MatrixXd columns = tape.evaluate(detail::library_variables(s, o));
    if (o.discrete) {
      const Eigen::Index n = s.samples() - 1;
      sums.add(columns.topRows(n), s.raw.bottomRows(n));
    } else {
      const detail::IntegralRows r = detail::integral_rows(s, columns, o.order, half);
      sums.add(r.theta, r.target);
    }
    sums.end_block();
  }
  return sums;
}

Problem select_terms(const Problem& all, const std::vector<int>& terms) {
  Problem p;
  const auto pick = [&](const GramBlock& b) {
    return GramBlock{b.gram(terms, terms), b.moment(terms), b.energy, b.rows};
  };
  p.total = pick(all.total);
  for (const GramBlock& b : all.blocks) p.blocks.push_back(pick(b));
  p.effective_rows = all.effective_rows;
  return p;
}

}  // namespace

IdentifiedModel fit_sindy(const std::vector<Recording>& records, const SindyOptions& options) {
  check(records, options);
  const detail::Candidates candidates = candidate_terms(options);
  std::vector<detail::Stretch> stretches = detail::finite_stretches(records, options);
  Eigen::VectorXd sd = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(options.states.size()));
  double rate = 0;
  Eigen::Index half = 1, samples = 0;
  for (detail::Stretch& s : stretches) samples += s.samples();
  if (samples < 50) throw Error::in_field("usable samples", std::to_string(samples), "at least 50");
  if (options.discrete) {
    for (detail::Stretch& s : stretches) s.smooth = s.raw;
  } else {
    sd = detail::smooth_stretches(stretches);
    rate = detail::characteristic_rate(stretches);
    half = std::lround((options.window > 0 ? options.window : 1 / rate) / records.front().dt);
  }

  IdentifiedModel model;
  model.method = "sindy";
  model.states = options.states;
  model.inputs = options.inputs;
  model.sample_time = records.front().dt;
  model.noise_sd = sd.mean();
  model.provenance.version = std::string(version());
  for (const Recording& r : records) model.provenance.inputs.push_back(r.source);
  if (options.order == 2) {
    for (const std::string& s : options.states) {
      model.states.push_back(s + "'");
      model.equations.push_back({s + "'", {{s + "'", {1, 0, 1, 1}, ""}}});
    }
  }

  std::vector<std::vector<Expr>> libraries;
  for (const auto& [lhs, terms] : candidates) libraries.push_back(terms);
  const std::vector<Expr> all = union_library(libraries);
  for (const Expr& e : all) {
    const std::vector<std::string> used = variables(e);
    const bool has = std::find(model.inputs.begin(), model.inputs.end(), "t") != model.inputs.end();
    if (!has && std::find(used.begin(), used.end(), "t") != used.end()) model.inputs.push_back("t");
  }
  if (all.empty()) {
    model.equations.insert(model.equations.end(), options.known.begin(), options.known.end());
    return model;
  }
  const GramAccumulator sums = accumulate(stretches, all, options, half);
  std::vector<Equation> alternatives;  // other supports on the path of the regression
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const std::string lhs = lhs_of(options.states[k], options);
    if (const Equation* known = known_equation(options, lhs)) {
      model.equations.push_back(*known);
      for (EquationTerm& t : model.equations.back().terms) t.coefficient.sd = 0;
      continue;
    }
    const std::vector<Expr>& terms = candidates.at(lhs);
    std::vector<int> index;
    for (const Expr& e : terms) {
      index.push_back(static_cast<int>(std::find(all.begin(), all.end(), e) - all.begin()));
    }
    Problem problem = select_terms(sums.problem(static_cast<Eigen::Index>(k)), index);
    // Windows overlap three times their stride.
    problem.effective_rows = options.discrete ? 0 : std::max(10.0, problem.total.rows / 3);
    SolveOptions solver = options.solver;
    if (solver.noise_floor == 0) solver.noise_floor = options.least_share;
    if (solver.max_terms == 0 && terms.size() > 12) solver.max_terms = 12;
    const SparseFit fit = solve(problem, solver);
    Equation equation{lhs, {}};
    for (int j : fit.support) {
      equation.terms.push_back({terms[static_cast<std::size_t>(j)].str(), Estimate::from_sd(fit.xi[j], fit.sd[j]), ""});
    }
    for (const PathPoint& point : fit.path) {
      if (point.terms == 0 || point.terms > 12) continue;
      Equation other{lhs, {}};
      for (Eigen::Index j = 0; j < point.xi.size(); ++j) {
        Estimate guess;
        guess.value = point.xi[j];
        if (guess.value != 0) other.terms.push_back({terms[static_cast<std::size_t>(j)].str(), guess, ""});
      }
      alternatives.push_back(std::move(other));
    }
    model.equations.push_back(std::move(equation));
    model.summary.condition_number = std::max(k == 0 ? 0 : model.summary.condition_number, fit.summary.condition_number);
    for (const std::string& w : fit.summary.warnings) model.summary.warn(lhs + ": " + w);
  }
  if (options.discrete || !options.refine) {
    detail::set_coefficient_units(model, records.front());
    return model;
  }

  // Below this share of the signal the integration error of the samples, not the noise, limits the fit.
  Eigen::VectorXd weight = sd;
  bool noisy = true;
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    double energy = 0;
    for (const detail::Stretch& s : stretches) energy += s.raw.col(column).squaredNorm();
    const double floor = 1e-6 * std::sqrt(energy / static_cast<double>(samples));
    noisy = noisy && sd[column] > floor;
    weight[column] = std::max(sd[column], floor);
  }
  detail::refine_and_select(model, candidates, alternatives, stretches, weight, rate, options);
  detail::set_coefficient_units(model, records.front());
  if (!noisy) model.summary.chi_square = std::numeric_limits<double>::quiet_NaN();
  return model;
}

Eigen::MatrixXd predict(const IdentifiedModel& model, const Recording& record) {
  const CompiledModel compiled(model);
  std::vector<std::string> names = compiled.states();
  names.insert(names.end(), compiled.inputs().begin(), compiled.inputs().end());
  Eigen::MatrixXd in(record.size(), static_cast<Eigen::Index>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) {
    in.col(static_cast<Eigen::Index>(k)) = names[k] == "t" && !record.has("t") ? record.times() : record[names[k]];
  }
  return compiled.tape().evaluate(in);
}

namespace {
/// States at every sample without most of the noise; a rate is that of the smoothed displacement.
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
}  // namespace

ModelRun simulate(const IdentifiedModel& model, const Recording& record) {
  const CompiledModel compiled(model);
  return simulate(compiled, half_grid_inputs(compiled, record), smoothed_states(compiled, record).row(0), record.dt,
                  record.size());
}

Eigen::VectorXd fit_percent(const IdentifiedModel& model, const Recording& record, double horizon) {
  const CompiledModel compiled(model);
  const Eigen::MatrixXd inputs = half_grid_inputs(compiled, record);
  const Eigen::MatrixXd starts = smoothed_states(compiled, record);
  const Eigen::Index n = record.size();
  const Eigen::Index piece = horizon > 0 ? std::max<Eigen::Index>(2, std::lround(horizon / record.dt)) : n;
  std::vector<std::string> measured;
  for (const std::string& s : compiled.states()) {
    if (record.has(s)) measured.push_back(s);
  }
  Eigen::VectorXd error = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(measured.size()));
  for (Eigen::Index first = 0; first < n; first += piece) {
    const Eigen::Index count = std::min(piece, n - first);
    const ModelRun run = simulate(compiled, inputs.middleRows(2 * first, 2 * count - 1), starts.row(first), record.dt, count);
    for (std::size_t k = 0; k < measured.size(); ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      error[i] += run.diverged ? std::numeric_limits<double>::infinity()
                               : (run.state(measured[k]) - record[measured[k]].segment(first, count)).squaredNorm();
    }
  }
  for (std::size_t k = 0; k < measured.size(); ++k) {
    const Eigen::VectorXd& y = record[measured[k]];
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    error[i] = 100 * (1 - std::sqrt(error[i]) / (y.array() - y.mean()).matrix().norm());
  }
  return error;
}

}  // namespace whirl
