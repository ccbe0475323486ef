#include "whirl/identify/refine.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "output_error/sensitivity.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification {
namespace {

struct Place {
  std::size_t equation, term;
};

/// Solves (N + mu diag N) step = g in columns scaled to unit diagonal; g may have several columns.
Eigen::MatrixXd damped_solve(const Eigen::MatrixXd& n, const Eigen::MatrixXd& g, double mu) {
  if (g.size() == 0) return g;  // no term is left in the model
  const Eigen::VectorXd scale = n.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  Eigen::MatrixXd m = scale.asDiagonal() * n * scale.asDiagonal();
  m.diagonal().array() += mu + 1e-13;
  return scale.asDiagonal() * m.ldlt().solve(scale.asDiagonal() * g);
}

/// The sums in the tied unknowns: normal = M' N M, gradient = M' g, M = diag(ties, 1).
void reduce(detail::StepSums& sums, const Eigen::MatrixXd& ties) {
  const Eigen::Index p = ties.rows(), w = ties.cols(), rest = sums.gradient.size() - p;
  Eigen::MatrixXd normal(w + rest, w + rest);
  normal.topLeftCorner(w, w) = ties.transpose() * sums.normal.topLeftCorner(p, p) * ties;
  normal.topRightCorner(w, rest) = ties.transpose() * sums.normal.topRightCorner(p, rest);
  normal.bottomLeftCorner(rest, w) = normal.topRightCorner(w, rest).transpose();
  normal.bottomRightCorner(rest, rest) = sums.normal.bottomRightCorner(rest, rest);
  Eigen::VectorXd gradient(w + rest);
  gradient << ties.transpose() * sums.gradient.head(p), sums.gradient.tail(rest);
  sums.normal = std::move(normal);
  sums.gradient = std::move(gradient);
}

}  // namespace

Refined refine_free_run(const IdentifiedModel& model, const std::vector<FreeRun>& runs, double dt,
                        const RefineOptions& options, const std::vector<Equation>& candidates) {
  const CompiledModel compiled(model);
  if (compiled.discrete()) throw Error("refinement on the free run is for differential equations, not maps");
  const auto state_index = [&](const std::string& name) {
    const auto at = std::find(compiled.states().begin(), compiled.states().end(), name);
    if (at == compiled.states().end()) throw Error::in_field("output", name, "a state of the model");
    return static_cast<Eigen::Index>(at - compiled.states().begin());
  };
  std::vector<Eigen::Index> outputs;
  for (const std::string& name : options.outputs) outputs.push_back(state_index(name));
  if (outputs.empty()) throw Error("refinement needs at least one measured state");
  const Eigen::Index n_out = static_cast<Eigen::Index>(outputs.size());
  for (const FreeRun& r : runs) {
    const Eigen::Index rows = r.measured.rows();
    if (rows < 2 || r.measured.cols() != n_out ||
        r.start.size() != static_cast<Eigen::Index>(compiled.states().size()) ||
        (!compiled.inputs().empty() &&
         (r.inputs.rows() != 2 * rows - 1 || r.inputs.cols() != static_cast<Eigen::Index>(compiled.inputs().size())))) {
      throw Error("a run for refinement has sizes that do not fit the model");
    }
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(n_out);
  if (options.output_sd.size() > 0) {
    if (options.output_sd.size() != n_out) throw Error("one noise sd per output is needed");
    weight = options.output_sd.cwiseInverse();
  }

  std::vector<detail::SensitiveTerm> terms;
  std::vector<Place> places;
  for (std::size_t e = 0; e < model.equations.size(); ++e) {
    const std::string& lhs = model.equations[e].lhs;
    const Eigen::Index state = state_index(lhs.substr(0, lhs.size() - 1));
    for (std::size_t t = 0; t < model.equations[e].terms.size(); ++t) {
      const EquationTerm& term = model.equations[e].terms[t];
      terms.push_back({state, expr::Expr::parse(term.function), term.coefficient.value, term.coefficient.sd != 0});
      if (terms.back().free) places.push_back({e, t});
    }
  }
  for (const std::string& s : compiled.states()) {  // X1' = X2 by convention
    const bool has = std::any_of(model.equations.begin(), model.equations.end(),
                                 [&](const Equation& e) { return e.lhs == s + "'"; });
    if (!has) terms.push_back({state_index(s), expr::Expr::symbol(s == "X1" ? "X2" : "X4"), 1, false});
  }
  detail::SensitivitySystem system(terms, compiled.states(), compiled.inputs());
  const Eigen::Index p = system.parameters(), n = system.states();

  Refined result;
  result.model = model;
  std::vector<FreeRun> trial = runs;
  const bool tied = options.ties.size() > 0;
  if (tied && (options.ties.rows() != p || !candidates.empty())) {
    throw Error("ties need one row per estimated coefficient, and no candidates");
  }
  const auto sums_at = [&](detail::SensitivitySystem& s, const std::vector<FreeRun>& at) {
    ++result.passes;
    detail::StepSums all = s.run(at, dt, outputs, weight, options.skip, options.free_start);
    if (tied) reduce(all, options.ties);
    return all;
  };
  const Eigen::Index unknowns = tied ? options.ties.cols() : p;
  detail::StepSums sums = sums_at(system, trial);
  if (sums.diverged || sums.rows <= sums.gradient.size()) {
    result.model.summary.warn("the free run of the starting model diverges: not refined");
    return result;
  }
  const auto free_terms = [](detail::SensitivitySystem& s) {
    std::vector<double*> theta;
    for (detail::SensitiveTerm& t : s.terms()) {
      if (t.free) theta.push_back(&t.theta);
    }
    return theta;
  };
  double mu = 1e-4;
  for (result.iterations = 0; result.iterations < options.max_iterations && !result.converged; ++result.iterations) {
    bool improved = false;
    for (int attempt = 0; attempt < 12 && !improved; ++attempt) {
      const Eigen::VectorXd step = damped_solve(sums.normal, sums.gradient, mu);
      detail::SensitivitySystem next = system;
      const std::vector<double*> theta = free_terms(next);
      const Eigen::VectorXd change =
          tied ? Eigen::VectorXd(options.ties * step.head(unknowns)) : Eigen::VectorXd(step.head(p));
      for (Eigen::Index j = 0; j < p; ++j) *theta[static_cast<std::size_t>(j)] += change[j];
      std::vector<FreeRun> moved = trial;
      if (options.free_start) {
        for (std::size_t r = 0; r < moved.size(); ++r) {
          moved[r].start += step.segment(unknowns + n * static_cast<Eigen::Index>(r), n);
        }
      }
      detail::StepSums after = sums_at(next, moved);
      if (!after.diverged && after.cost <= sums.cost) {
        result.converged = sums.cost - after.cost <= options.tolerance * sums.cost;
        system = std::move(next);
        trial = std::move(moved);
        sums = std::move(after);
        improved = true;
        mu = std::max(mu * 0.1, 1e-12);
      } else {
        mu = std::max(mu * 10, 1e-10);
      }
    }
    if (!improved) {
      result.converged = true;  // no direction lowers the error any more
      break;
    }
  }
  const double freedom = static_cast<double>(sums.rows - sums.gradient.size());
  const double variance = sums.cost / freedom;
  result.covariance =
      variance *
      damped_solve(sums.normal, Eigen::MatrixXd::Identity(sums.normal.rows(), unknowns), 0).topRows(unknowns);
  const std::vector<double*> theta = free_terms(system);
  for (std::size_t j = 0; j < places.size(); ++j) {
    const Eigen::Index i = static_cast<Eigen::Index>(j);
    const double square =
        tied ? options.ties.row(i) * result.covariance * options.ties.row(i).transpose() : result.covariance(i, i);
    result.model.equations[places[j].equation].terms[places[j].term].coefficient =
        Estimate::from_sd(*theta[j], std::sqrt(std::max(0.0, square)));
  }
  for (const FreeRun& r : trial) result.starts.push_back(r.start);
  result.rmse = std::sqrt(sums.cost / static_cast<double>(sums.rows));
  result.output_rmse = sums.cost_of.cwiseQuotient(sums.rows_of.cwiseMax(1)).cwiseSqrt();
  result.model.summary.residual = result.rmse;
  if (!result.converged) result.model.summary.warn("the refinement on the free run did not converge");

  // Score test: sensitivities of the absent terms along the final trajectory, what the model explains projected out.
  std::vector<detail::SensitiveTerm> extended = system.terms();
  std::vector<std::pair<std::string, std::string>> labels;
  for (const Equation& e : candidates) {
    for (const EquationTerm& t : e.terms) {
      extended.push_back({state_index(e.lhs.substr(0, e.lhs.size() - 1)), expr::Expr::parse(t.function), 0, true});
      labels.emplace_back(e.lhs, t.function);
    }
  }
  if (labels.empty()) return result;
  const std::size_t known = extended.size() - labels.size();
  detail::SensitivitySystem wide(std::move(extended), compiled.states(), compiled.inputs());
  const detail::StepSums all = sums_at(wide, trial);
  std::vector<int> base, extra;  // positions among the unknowns of `wide`
  int position = 0;
  for (std::size_t k = 0; k < wide.terms().size(); ++k) {
    if (wide.terms()[k].free) (k < known ? base : extra).push_back(position++);
  }
  for (Eigen::Index j = wide.parameters(); j < all.gradient.size(); ++j) base.push_back(static_cast<int>(j));
  const Eigen::MatrixXd couplings = all.normal(base, extra);
  const Eigen::MatrixXd explained = damped_solve(all.normal(base, base), couplings, 0);
  for (std::size_t k = 0; k < extra.size(); ++k) {
    const int j = extra[k];
    const Eigen::VectorXd solved = explained.col(static_cast<Eigen::Index>(k));
    const double left = all.normal(j, j) - couplings.col(static_cast<Eigen::Index>(k)).dot(solved);
    if (!(left > 1e-10 * all.normal(j, j))) continue;  // the model explains this column
    const double gradient = all.gradient[j] - solved.dot(Eigen::VectorXd(all.gradient(base)));
    result.scores.push_back(
        {labels[k].first, labels[k].second, gradient * gradient / left / variance, gradient / left});
  }
  std::sort(result.scores.begin(), result.scores.end(),
            [](const TermScore& a, const TermScore& b) { return a.score > b.score; });
  return result;
}

}  // namespace whirl::identification
