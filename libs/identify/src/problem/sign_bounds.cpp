#include "problem/sign_bounds.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::identification::detail {
namespace {

/// "v'", or "v" for short.
bool names_equation(const std::string& name, const std::string& lhs) {
  return name.empty() || name == lhs || name == lhs.substr(0, lhs.find_first_of("'["));
}

std::string allowed(const std::string& equation, const Candidates& candidates) {
  std::vector<std::string> parts;
  for (const auto& [lhs, terms] : candidates) {
    if (!names_equation(equation, lhs)) continue;
    std::vector<std::string> texts;
    for (const expr::Expr& e : terms) texts.push_back(e.str());
    parts.push_back(fmt::format("{}: {}", lhs, fmt::join(texts, ", ")));
  }
  if (!parts.empty()) return fmt::format("a term of the library ({})", fmt::join(parts, "; "));
  std::vector<std::string> sought;
  for (const auto& [lhs, terms] : candidates) sought.push_back(lhs);
  return fmt::format("of an equation that is sought ({})", fmt::join(sought, ", "));
}

std::string text_of(const BoundOutcome& b) {
  return fmt::format("{}: {} {} 0", b.equation, b.function, b.sign > 0 ? ">=" : "<=");
}

}  // namespace

Signs resolve_signs(const std::vector<SignBound>& bounds, const Candidates& candidates) {
  Signs signs;
  for (const SignBound& bound : bounds) {
    const std::string label = bound.equation.empty() ? bound.function : bound.equation + ":" + bound.function;
    if (bound.sign != 1 && bound.sign != -1)
      throw Error::in_field("sign of " + label, std::to_string(bound.sign), "1 or -1");
    const auto [number, function] = expr::split_coefficient(expr::Expr::parse(bound.function));
    bool found = false;
    for (const auto& [lhs, terms] : candidates) {
      if (!names_equation(bound.equation, lhs)) continue;
      for (const expr::Expr& term : terms) {
        const auto [factor, rest] = expr::split_coefficient(term);
        if (!(rest == function)) continue;
        found = true;
        const int sign = number * factor < 0 ? -bound.sign : bound.sign;
        const auto [at, added] = signs[lhs].emplace(term.str(), sign);
        if (!added && at->second != sign)
          throw Error(fmt::format("sign bounds of {}: {} contradict each other", lhs, term.str()));
      }
    }
    if (!found) throw Error::in_field("sign bound", label, allowed(bound.equation, candidates));
  }
  return signs;
}

int sign_of(const Signs& signs, const std::string& lhs, const std::string& function) {
  const auto equation = signs.find(lhs);
  if (equation == signs.end()) return 0;
  const auto term = equation->second.find(function);
  return term == equation->second.end() ? 0 : term->second;
}

std::vector<TermScore> blocked_terms(const regression::Problem& problem, const regression::SparseFit& fit,
                                     const std::vector<int>& sign, const std::string& lhs, double t_value) {
  std::vector<TermScore> blocked;
  const double without = problem.total.residual(regression::refit(problem.total, fit.support));
  for (std::size_t j = 0; j < sign.size(); ++j) {
    const Eigen::Index at = static_cast<Eigen::Index>(j);
    if (sign[j] == 0 || fit.xi[at] != 0) continue;
    std::vector<int> support = fit.support;
    support.push_back(static_cast<int>(j));
    const Eigen::VectorXd xi = regression::refit(problem.total, support);
    if (!(sign[j] * xi[at] < 0)) continue;
    const double freedom = std::max(1.0, problem.information_rows() - static_cast<double>(support.size()));
    // Below 1e-14 the residual of a Gram matrix is rounding.
    const double with = std::max(problem.total.residual(xi), 1e-14 * problem.total.energy);
    const double score = (without - with) / with * freedom;
    if (score >= t_value * t_value) blocked.push_back({lhs, problem.names[j], score, xi[at]});
  }
  return blocked;
}

std::vector<BoundOutcome> conclude_bounds(const Signs& signs, const std::vector<TermScore>& blocked,
                                          IdentifiedModel& model) {
  std::vector<BoundOutcome> outcomes;
  for (const auto& [lhs, terms] : signs) {
    for (const auto& [function, sign] : terms) {
      BoundOutcome outcome{.equation = lhs, .function = function, .sign = sign};
      for (Equation& e : model.equations) {
        for (EquationTerm& t : e.terms) {
          if (e.lhs != lhs || t.function != function) continue;
          outcome.kept = true;
          double& end = sign > 0 ? t.coefficient.low : t.coefficient.high;
          if (sign * end < 0) end = 0;
        }
      }
      for (const TermScore& s : blocked) {
        if (s.equation != lhs || s.function != function) continue;
        outcome.active = true;
        outcome.unbounded = s.coefficient;
        outcome.t = std::copysign(std::sqrt(s.score), s.coefficient);
      }
      if (outcome.active) {
        model.summary.warn(
            fmt::format("the sign bound {} is active: the records require about {:.3g} (t {:.3g}); the coefficient is "
                        "held at 0 and has no interval, the intervals of the other terms hold with it there",
                        text_of(outcome), outcome.unbounded, outcome.t));
      }
      outcomes.push_back(std::move(outcome));
    }
  }
  return outcomes;
}

}  // namespace whirl::identification::detail
