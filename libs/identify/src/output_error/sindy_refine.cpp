#include "output_error/sindy_refine.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "output_error/term_search.hpp"

namespace whirl::identification::detail {

Followed refine_and_select(IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
                           const std::vector<Equation>& alternatives, const std::vector<Stretch>& stretches,
                           const Eigen::VectorXd& sd, double characteristic_rate, const SindyOptions& options) {
  TermSearch selector(model, candidates, signs, stretches, sd, characteristic_rate, options);
  const IdentifiedModel start = model;
  TermSearch::Outcome outcome = selector.settle(model);
  while (outcome == TermSearch::Outcome::diverged) {
    model = start;
    if (!selector.shorten()) return {};
    outcome = selector.settle(model);
  }
  if (outcome == TermSearch::Outcome::stopped) {
    model.summary.fail(
        fmt::format("after {} passes over the free runs terms still come and go", options.search.max_passes));
    for (Equation& e : model.equations) {
      std::erase_if(e.terms,
                    [&](const EquationTerm& t) { return sign_of(signs, e.lhs, t.function) * t.coefficient.value < 0; });
    }
  }
  while (selector.lengthen(model)) {
  }
  for (const Equation& other : alternatives) {
    const auto present = std::find_if(model.equations.begin(), model.equations.end(),
                                      [&](const Equation& e) { return e.lhs == other.lhs; });
    Rival rival{other, 0, 0};
    if (other.terms.size() <= present->terms.size()) selector.exchange(model, rival);
  }
  const std::vector<Rival> rivals = selector.settle_rivals(model);
  if (selector.spent() && outcome == TermSearch::Outcome::settled) {
    model.summary.warn(fmt::format("the trial of other terms was cut short after {} passes over the free runs",
                                   options.search.max_passes));
  }
  if (!selector.converged()) model.summary.warn("the refinement on free runs did not converge");
  // Weighted residuals have variance 1 when only the estimated noise is left.
  model.summary.chi_square = selector.rmse() * selector.rmse();
  model.summary.residual = selector.rmse();
  Followed followed = selector.followed();
  for (const Rival& r : rivals) followed.rivals.push_back({r.equation, r.chi_square});
  return followed;
}

}  // namespace whirl::identification::detail
