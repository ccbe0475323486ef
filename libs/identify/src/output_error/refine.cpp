#include "whirl/identify/refine.hpp"

#include <algorithm>
#include <cmath>

#include "output_error/score.hpp"
#include "output_error/states_problem.hpp"
#include "output_error/substeps.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification {
namespace {

Eigen::Index state_index(const CompiledModel& model, const std::string& name) {
  const auto at = std::find(model.states().begin(), model.states().end(), name);
  if (at == model.states().end()) throw Error::in_field("output", name, "a state of the model");
  return static_cast<Eigen::Index>(at - model.states().begin());
}
Eigen::Index state_of(const CompiledModel& model, const Equation& e) {
  return state_index(model, e.lhs.substr(0, e.lhs.size() - 1));
}

/// Terms of all equations; those that are estimated are free.
std::vector<detail::SensitiveTerm> sensitive_terms(const IdentifiedModel& model, const CompiledModel& compiled) {
  std::vector<detail::SensitiveTerm> terms;
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      terms.push_back(
          {state_of(compiled, e), expr::Expr::parse(t.function), t.coefficient.value, t.coefficient.sd != 0});
    }
  }
  for (const std::string& s : compiled.states()) {  // X1' = X2 by convention
    const bool has = std::any_of(model.equations.begin(), model.equations.end(),
                                 [&](const Equation& e) { return e.lhs == s + "'"; });
    if (!has) terms.push_back({state_index(compiled, s), expr::Expr::symbol(s == "X1" ? "X2" : "X4"), 1, false});
  }
  return terms;
}

/// Estimated coefficients with the intervals of their covariance, in the order of equations and terms.
void take_coefficients(const Eigen::VectorXd& theta, const Eigen::MatrixXd& ties, const Eigen::MatrixXd& covariance,
                       IdentifiedModel& model) {
  Eigen::Index i = 0;
  for (Equation& e : model.equations) {
    for (EquationTerm& t : e.terms) {
      if (t.coefficient.sd == 0) continue;
      const double variance = ties.size() > 0 ? ties.row(i) * covariance * ties.row(i).transpose() : covariance(i, i);
      t.coefficient = Estimate::from_sd(theta[i], std::sqrt(std::max(0.0, variance)));
      ++i;
    }
  }
}

/// Score test: sensitivities of the absent terms along the final trajectory, what the model explains projected out.
void score_absent(const std::vector<Equation>& candidates, const CompiledModel& compiled,
                  std::vector<detail::SensitiveTerm> terms, const std::vector<FreeRun>& runs, double dt,
                  const std::vector<Eigen::Index>& outputs, const RefineOptions& options, detail::StatesPoint point,
                  double variance, Refined& result) {
  std::vector<TermScore>& scores = result.scores;
  const auto known = std::count_if(terms.begin(), terms.end(), [](const auto& t) { return t.free; });
  for (const Equation& e : candidates) {
    for (const EquationTerm& t : e.terms) {
      terms.push_back({state_of(compiled, e), expr::Expr::parse(t.function), 0, true});
      scores.push_back({e.lhs, t.function, 0, 0});
    }
  }
  if (scores.empty()) return;
  const auto added = static_cast<Eigen::Index>(scores.size());
  detail::StatesProblem wide(detail::SensitivitySystem(std::move(terms), compiled.states(), compiled.inputs()), runs,
                             dt, outputs, options);
  point.theta.conservativeResizeLike(Eigen::VectorXd::Zero(known + added));
  SquareSum sum;
  wide.linearise(point, sum);
  std::vector<int> active, starts, coefficients;
  std::vector<std::vector<int>> absent;
  for (int j = 0; j < static_cast<int>(sum.gradient.size()); ++j) {
    (j < known + added ? coefficients : starts).push_back(j);
    if (j >= known && j < known + added) {
      absent.push_back({j});
    } else {
      active.push_back(j);
    }
  }
  const std::vector<detail::Remainder> left = detail::remainders(sum.normal, sum.gradient, active, absent);
  for (std::size_t k = 0; k < scores.size(); ++k) {
    if (!(left[k].share > 1e-10)) continue;  // the model explains this column to rounding
    const detail::Evidence e = detail::evidence(left[k], variance);
    scores[k].score = e.score;
    scores[k].coefficient = e.coefficient[0];
  }
  std::erase_if(scores, [](const TermScore& s) { return s.score == 0; });
  std::sort(scores.begin(), scores.end(), [](const TermScore& a, const TermScore& b) { return a.score > b.score; });
  detail::Remainder all = detail::remainders(sum.normal, sum.gradient, starts, {coefficients}).front();
  result.information = std::move(all.information);
  result.gradient = std::move(all.gradient);
}

}  // namespace

Refined refine_free_run(const IdentifiedModel& model, const std::vector<FreeRun>& runs, double dt,
                        const RefineOptions& given, const std::vector<Equation>& candidates) {
  RefineOptions options = given;
  const CompiledModel compiled(model);
  if (compiled.discrete()) throw Error("refinement on the free run is for differential equations, not maps");
  if (options.ties.size() > 0 && !candidates.empty()) throw Error("with ties no candidates can be scored");
  std::vector<Eigen::Index> outputs;
  for (const std::string& name : options.outputs) outputs.push_back(state_index(compiled, name));
  if (options.substeps == 0)
    options.substeps = compiled.inputs().empty() ? detail::substeps_needed(compiled, runs, runs, dt, options) : 1;
  const std::vector<detail::SensitiveTerm> terms = sensitive_terms(model, compiled);
  detail::StatesProblem problem(detail::SensitivitySystem(terms, compiled.states(), compiled.inputs()), runs, dt,
                                outputs, options);

  Refined result;
  result.model = model;
  detail::StatesPoint point = problem.start();
  const detail::OutputError found = detail::fit_output_error(problem, point, options.max_iterations);
  result.passes = problem.passes();
  if (found.diverged || !(found.freedom > 0)) {
    result.model.summary.warn("the free run of the starting model diverges: not refined");
    return result;
  }
  result.iterations = found.descent.iterations;
  // A direction along which nothing lowers the error any more is an end too.
  result.converged = found.descent.end == Descent::converged || found.descent.end == Descent::stalled;
  // A direction that the runs do not show gets a large uncertainty, not none.
  result.covariance =
      found.variance() *
      invert_information(marginal_information(found.sum.normal, problem.coefficients()), 1e-13).covariance;
  take_coefficients(point.theta, options.ties, result.covariance, result.model);
  result.starts = point.starts;
  result.rmse = std::sqrt(found.sum.cost / found.values);
  result.output_rmse = point.cost_of.cwiseQuotient(point.rows_of.cwiseMax(1)).cwiseSqrt();
  result.output_rows = point.rows_of;
  result.autocorrelation = point.cost_of.cwiseMax(1e-300).cwiseInverse().asDiagonal() * point.lag_of;
  result.model.summary.residual = result.rmse;
  if (!result.converged) result.model.summary.warn("the refinement on the free run did not converge");
  if (!candidates.empty()) {
    ++result.passes;
    score_absent(candidates, compiled, terms, runs, dt, outputs, options, std::move(point), found.variance(), result);
  }
  return result;
}

}  // namespace whirl::identification
