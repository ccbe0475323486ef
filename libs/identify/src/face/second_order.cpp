#include "whirl/identify/second_order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "evidence/channel_units.hpp"
#include "evidence/record_quality.hpp"
#include "evidence/verdict.hpp"
#include "output_error/substeps.hpp"
#include "rules/rules.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/signal/derivative.hpp"
#include "whirl/signal/filter.hpp"
#include "whirl/signal/noise.hpp"
#include "whirl/signal/resample.hpp"

namespace whirl::identification {
namespace {

constexpr double kFloor = 1e-6;    // of the motion: errors of integration and interpolation
constexpr double kCalm = 1e-3;     // of the motion: noise that differences bear
constexpr Eigen::Index kEnd = 20;  // samples at each end that carry the end effect of the resampling

FreeRun free_run(const CompiledModel& model, const Recording& r, const std::string& output, int steps) {
  const Eigen::VectorXd& y = r[output];
  FreeRun run;
  // y + (y[1] - y[-1]) / 2h needs the sample before: the run starts at sample 1.
  const Eigen::Index n = y.size() - 1;
  run.start = (Eigen::VectorXd(2) << y[1], (y[2] - y[0]) / (2 * r.dt)).finished();
  const double noise = signal::noise_sd(y), spread = std::sqrt((y.array() - y.mean()).square().mean());
  if (noise > kCalm * spread) {  // differences of noise are no velocity
    const signal::SmoothedSignal smooth = detail::without_noise(y, r.dt, noise);
    run.start << smooth.value[1], smooth.first[1];
  }
  run.inputs = half_grid_inputs(model, r, steps).bottomRows(2 * steps * (n - 1) + 1);
  run.measured = y.tail(n);
  return run;
}

void add_linear_parameters(IdentifiedModel& model, const std::string& y) {
  const CompiledModel compiled(model);
  // Slopes of f at the origin, inputs at zero.
  std::map<std::string, double, std::less<>> origin;
  for (const std::string& s : compiled.states()) origin[s] = 0;
  for (const std::string& s : compiled.inputs()) origin[s] = 0;
  double stiffness = 0, damping = 0;
  for (const EquationTerm& t : model.equations[1].terms) {
    const expr::Expr f = expr::Expr::parse(t.function);
    stiffness -= t.coefficient.value * expr::evaluate(expr::differentiate(f, y), origin);
    damping -= t.coefficient.value * expr::evaluate(expr::differentiate(f, y + "'"), origin);
  }
  if (!(stiffness > 0)) return;
  Estimate e;
  e.value = std::sqrt(stiffness) / (2 * std::numbers::pi);
  model.parameters.emplace_back("f0", e);
  e.value = damping / (2 * std::sqrt(stiffness));
  model.parameters.emplace_back("zeta", e);
}

/// rms of the free run over the record from the start that suits its first period best; infinite when it diverges. A
/// start from differences of noisy samples would count until it has died out.
double error_on(const IdentifiedModel& model, const Recording& record, const std::string& output) {
  for (const StateScore& s : score(model, record)) {
    if (s.state == output) return std::isfinite(s.rmse) ? s.rmse : std::numeric_limits<double>::infinity();
  }
  return std::numeric_limits<double>::infinity();
}

/// What a free run with this error leaves of the motion beyond the noise, both rms.
double unexplained_share(const Eigen::VectorXd& y, double error) {
  const double noise = std::pow(signal::noise_sd(y), 2), spread = (y.array() - y.mean()).square().mean();
  return std::sqrt(std::max(0.0, error * error - noise) / std::max(spread - noise, 0.01 * spread));
}

/// SecondOrderRefinement on free runs over records.
struct SecondOrderRefinement {
  std::string output;
  Eigen::Index skip = 0;
  int steps = 1;  ///< a sample

  RefineOptions options() const {
    RefineOptions r;
    r.outputs = {output};
    r.skip = skip;
    return r;
  }
  Refined operator()(const IdentifiedModel& model, const Recording& record,
                     const std::vector<Equation>& candidates) const {
    return refine_free_run(model, {free_run(CompiledModel(model), record, output, steps)}, record.dt, options(),
                           candidates);
  }
  /// More steps a sample where the record asks for them; the model then says that its input acts between the samples.
  void choose_steps(IdentifiedModel& model, const Recording& record) {
    const Refined coarse = (*this)(model, record, {});
    if (coarse.starts.empty()) return;
    const auto run_at = [&](int s) {
      std::vector<FreeRun> runs{free_run(CompiledModel(model), record, output, s)};
      runs.front().start = coarse.starts.front();
      return runs;
    };
    const detail::FinerSteps found = detail::finer_steps(coarse.model, run_at, steps, record.dt, options());
    if (found.steps == steps) return;
    steps = found.steps;
    model.equations = found.fit.model.equations;
    model.timing = {{model.inputs.front(), Hold::band_limited, {0, 0, 0, 0}}};
  }
};

/// Regression of the oversampled, filtered second derivative on the library: start of the refinement.
regression::SparseFit regress(const Recording& recording, const std::string& output, const std::string& input,
                              const std::vector<expr::Expr>& terms, const std::vector<std::string>& library,
                              const expr::Tape& tape, const SecondOrderOptions& options) {
  const int k = options.oversample;
  const double dt = recording.dt / k;
  const Eigen::VectorXd fine = signal::upsample(recording[output], k), fine_u = signal::upsample(recording[input], k);
  const Eigen::VectorXd v = signal::central_difference(fine, dt, 4);
  const Eigen::VectorXd a = signal::central_difference(v, dt, 4);
  const Eigen::Index n = a.size();
  Eigen::MatrixXd variables(n, 4);
  variables.col(0) = fine.segment(4, n);
  variables.col(1) = v.segment(2, n);
  variables.col(2) = fine_u.segment(4, n);
  for (Eigen::Index i = 0; i < n; ++i) variables(i, 3) = recording.t0 + dt * static_cast<double>(i + 4);
  Eigen::MatrixXd theta = tape.evaluate(variables);
  Eigen::VectorXd target = a;
  const double sd = options.filter_sd / dt;
  if (sd > 0) {
    theta = signal::gaussian_filter_columns(theta, sd);
    target = signal::gaussian_filter(target, sd);
  }
  const Eigen::Index cut = kEnd * k + signal::gaussian_reach(sd);
  const Eigen::Index inside = n - 2 * cut;
  if (inside < 100)
    throw Error::in_field("filter width", fmt::format("{} s", options.filter_sd), "far below the record");
  regression::SolveOptions solver = options.solver;
  for (std::size_t j = 0; j < terms.size(); ++j) {
    if (terms[j].is_number()) solver.rules.keep.push_back(static_cast<int>(j));
  }
  return regression::solve(
      regression::make_problem(theta.middleRows(cut, inside), target.segment(cut, inside), 50, library), solver);
}

/// The library fitted by the weak form and free runs of short stretches: differentiates no noise and survives chaos.
/// Empty where that gives no usable model.
std::optional<IdentifiedModel> by_stretches(const Recording& recording, const IdentifiedModel& like,
                                            const std::vector<expr::Expr>& terms) {
  SindyOptions sindy;
  sindy.states = {like.states.front()};
  sindy.inputs = like.inputs;
  sindy.order = 2;
  sindy.timing.find = false;
  for (const expr::Expr& t : terms) sindy.library.push_back(t.str());
  try {
    IdentifiedModel found = fit_sindy({recording}, sindy);
    if (found.equations.size() != 2 || found.summary.status == Status::unusable) return std::nullopt;
    return found;
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Adds the constants of the library that an equation lacks: a sensor offset is not sparse.
void keep_constants(const std::vector<expr::Expr>& terms, Equation& motion) {
  for (const expr::Expr& t : terms) {
    const bool there = std::any_of(motion.terms.begin(), motion.terms.end(),
                                   [&](const EquationTerm& m) { return expr::Expr::parse(m.function) == t; });
    if (t.is_number() && !there) motion.terms.push_back({t.str(), Estimate::from_sd(0, INFINITY), ""});
  }
}

/// Candidates that the motion equation of a model does not have yet.
std::vector<Equation> absent_terms(const IdentifiedModel& model, const std::vector<std::string>& candidates) {
  Equation e{model.equations[1].lhs, {}};
  for (const std::string& text : candidates) {
    const expr::Expr c = expr::split_coefficient(expr::Expr::parse(text)).second;
    const bool present = std::any_of(
        model.equations[1].terms.begin(), model.equations[1].terms.end(),
        [&](const EquationTerm& t) { return expr::split_coefficient(expr::Expr::parse(t.function)).second == c; });
    if (!present) e.terms.push_back({text, {}, ""});
  }
  return {e};
}

/// Refines on the first part of the record and takes up candidates that lower the free-run error on the rest; `error`:
/// that on the rest.
IdentifiedModel grow(const IdentifiedModel& model, const Recording& recording, const std::string& output,
                     const std::vector<std::string>& candidates, const SecondOrderOptions& options,
                     const SecondOrderRefinement& refine, double& error) {
  const Eigen::Index split = static_cast<Eigen::Index>((1 - options.holdout) * static_cast<double>(recording.size()));
  const Recording train = part_of(recording, 0, split), held = part_of(recording, split, recording.size() - split);
  Refined best = refine(model, train, absent_terms(model, candidates));
  error = error_on(best.model, held, output);
  const Eigen::VectorXd& y = recording[output];
  const double floor = kFloor * std::sqrt((y.array() - y.mean()).square().mean());
  for (int added = 0; added < options.max_added && error > floor; ++added) {
    // The three best scores are tried: the score is a first-order guess of what refinement makes of a term.
    Refined next;
    double next_error = error * (1 - options.least_gain);
    for (std::size_t k = 0; k < std::min<std::size_t>(3, best.scores.size()); ++k) {
      const TermScore& s = best.scores[k];
      if (s.score < rules::kTerm) break;
      IdentifiedModel larger = best.model;
      Estimate start;
      start.value = s.coefficient;
      larger.equations[1].terms.push_back({s.function, start, ""});
      Refined trial = refine(larger, train, absent_terms(larger, candidates));
      const double trial_error =
          trial.converged ? error_on(trial.model, held, output) : std::numeric_limits<double>::infinity();
      if (trial_error < next_error) {
        next_error = trial_error;
        next = std::move(trial);
      }
    }
    if (!next.converged) break;
    best = std::move(next);
    error = next_error;
  }
  return refine(best.model, recording, {}).model;
}

/// The verdict by the free run over the record.
void judge(const Recording& recording, const std::string& output, IdentifiedModel& model) {
  Summary& summary = model.summary;
  summary.residual = error_on(model, recording, output);
  if (!std::isfinite(summary.residual)) {
    summary.fail("the free run of the identified model diverges");
  } else {
    detail::judge_unexplained(unexplained_share(recording[output], summary.residual), "the free run leaves",
                              "a term is missing, the input is not what drives the motion, or the run is chaotic",
                              summary);
  }
  detail::set_trust(summary.trust, summary);
}

/// SecondOrderRefinement of what the regression found, or of what stretches give where its free run is poor; that of
/// stretches itself where no single run follows the record.
IdentifiedModel refined(const IdentifiedModel& regressed, const Recording& recording,
                        const std::vector<expr::Expr>& terms, const SecondOrderOptions& options) {
  const std::string &y = regressed.states[0], &rate = regressed.states[1], &u = regressed.inputs[0];
  const auto poor = [&](const IdentifiedModel& m) {
    return !(unexplained_share(recording[y], error_on(m, recording, y)) < rules::kUnexplained);
  };
  std::vector<std::string> candidates = options.candidates;
  if (candidates.empty()) {
    candidates = {y + "^2",
                  y + "^4",
                  y + "^5",
                  y + "*" + rate,
                  y + "^2*" + rate,
                  rate + "*abs(" + rate + ")",
                  "sgn(" + rate + ")",
                  u + "*" + y};
  }
  for (const expr::Expr& t : terms) candidates.push_back(t.str());
  IdentifiedModel start = regressed;
  std::optional<IdentifiedModel> shot;
  if (poor(regressed) && (shot = by_stretches(recording, regressed, terms))) {
    start.equations[1].terms = shot->equations[1].terms;
    keep_constants(terms, start.equations[1]);
  }
  double error = 0;
  SecondOrderRefinement refine{y, options.skip};
  refine.choose_steps(start, recording);
  IdentifiedModel model = grow(start, recording, y, candidates, options, refine, error);
  model.summary.condition_number = regressed.summary.condition_number;
  model.summary.trust = fmt::format("rms free-run error on the held-out {:.0f} % of the record: {:.3g} (unit of {})",
                                    100 * options.holdout, error, y);
  if (!shot || !poor(model)) {
    judge(recording, y, model);
    return model;
  }
  model.equations[1].terms = shot->equations[1].terms;
  model.timing = shot->timing;
  model.summary = shot->summary;
  return model;
}

}  // namespace

double free_run_error(const IdentifiedModel& model, const Recording& recording, const std::string& output,
                      Eigen::Index skip) {
  const CompiledModel compiled(model);
  const FreeRun run = free_run(compiled, recording, output, input_steps_of(model));
  const Eigen::Index n = run.measured.rows();
  if (n <= skip) throw Error::in_field("samples", std::to_string(n), fmt::format("more than the {} skipped", skip));
  const ModelRun result = simulate(compiled, run.inputs, run.start, recording.dt, n);
  if (result.diverged) return std::numeric_limits<double>::infinity();
  const Eigen::VectorXd error = (run.measured.col(0) - result.state(output)).tail(n - skip);
  return error.norm() / std::sqrt(static_cast<double>(n - skip));
}

IdentifiedModel identify_second_order(const Recording& recording, const SecondOrderOptions& options) {
  const std::string &output = options.output, &input = options.input;
  recording.check();
  for (const std::string& channel : {output, input})
    static_cast<void>(recording[channel]);  // throws where it is missing
  const std::string rate = output + "'";
  if (recording.size() < 200) throw Error::in_field("samples", std::to_string(recording.size()), "at least 200");
  require_range("oversample", options.oversample, 1, 64);
  require_range("holdout", options.holdout, 0.05, 0.8);

  std::vector<std::string> library = options.library;
  if (library.empty()) {
    library = {"1", output, output + "^2", output + "^3", rate, input};
  }
  const std::vector<expr::Expr> terms = expr::parse_library(library);
  const expr::Tape tape = expr::compile(terms, {output, rate, input, "t"});

  IdentifiedModel model;
  model.method = "second_order";
  model.states = {output, rate};
  model.inputs = {input};
  detail::check_signals({recording}, {output}, {input}, false, model.summary);
  if (model.summary.status == Status::unusable) {
    model.summary.trust = "Do not use this model.";
    return model;
  }

  const regression::SparseFit fit = regress(recording, output, input, terms, library, tape, options);
  Equation kinematic{rate, {{rate, {1, 0, 1, 1}, ""}}};
  Equation motion{rate + "'", {}};
  for (int j : fit.support) {
    motion.terms.push_back({terms[static_cast<std::size_t>(j)].str(), Estimate::from_sd(fit.xi[j], fit.sd[j]), ""});
  }
  model.equations = {kinematic, motion};
  model.sample_time = recording.dt;
  model.summary = fit.summary;
  model.provenance.version = std::string(version());
  model.provenance.inputs = {recording.source};
  if (options.refine) {
    model = refined(model, recording, terms, options);
  } else {
    judge(recording, output, model);
  }
  add_linear_parameters(model, output);
  detail::set_coefficient_units(model, recording);
  return model;
}

}  // namespace whirl::identification
