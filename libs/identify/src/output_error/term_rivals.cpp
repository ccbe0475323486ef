// Sets of terms that explain the records as well as those of the model.
#include <algorithm>
#include <cmath>
#include <limits>

#include "output_error/model_terms.hpp"
#include "output_error/rival_terms.hpp"
#include "output_error/term_search.hpp"
#include "rules/rules.hpp"

namespace whirl::identification::detail {
namespace {

/// A coefficient of the information matrix of the score test.
struct Column {
  std::string lhs, function;
  double value;  // 0: not in the model
  bool estimated;
};

/// In the order of the matrix: estimated terms of the model, then absent candidates.
std::vector<Column> columns_of(const IdentifiedModel& model, const Candidates& candidates) {
  std::vector<Column> columns;
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) columns.push_back({e.lhs, t.function, t.coefficient.value, true});
    }
  }
  for (const Equation& e : absent_terms(model, candidates)) {
    for (const EquationTerm& t : e.terms) columns.push_back({e.lhs, t.function, 0, false});
  }
  return columns;
}

}  // namespace

bool TermSearch::exchange(IdentifiedModel& model, Rival& other) {
  const auto at =
      static_cast<std::size_t>(std::find_if(model.equations.begin(), model.equations.end(),
                                            [&](const Equation& e) { return e.lhs == other.equation.lhs; }) -
                               model.equations.begin());
  const Equation& present = model.equations[at];
  other.excess = std::numeric_limits<double>::infinity();
  // Every term of the present model is needed already: a part of it cannot do.
  if (spent() || within(other.equation, present)) return false;
  return attempt(model, [&](IdentifiedModel& trial) {
    trial.equations[at] = other.equation;
    RefineOptions few = refine_;
    few.max_iterations = 2;
    Refined found = refined(trial, few);
    // A hopeless support shows at once.
    if (found.starts.empty() || square(found.rmse) > 4 * square(followed_.rmse)) return false;
    few.max_iterations = 6;
    found = refined(found.model, few);
    if (found.starts.empty()) return false;  // diverged after all
    const double rows = samples();
    const double now =
        rows * std::log(square(followed_.rmse)) + std::log(rows) * static_cast<double>(present.terms.size());
    const double then =
        rows * std::log(square(found.rmse)) + std::log(rows) * static_cast<double>(other.equation.terms.size());
    other = {found.model.equations[at], then - now, square(found.rmse)};
    if (then >= now) return false;
    take(trial, found);
    return settle(trial) == Outcome::settled;
  });
}

std::vector<Rival> TermSearch::rivals(const IdentifiedModel& model, double margin) const {
  std::vector<Rival> found;
  const std::vector<Column> columns = columns_of(model, candidates_);
  const Eigen::Index n = followed_.gradient.size();
  if (n == 0 || static_cast<Eigen::Index>(columns.size()) != n) return found;
  Eigen::VectorXd xi(n);
  for (Eigen::Index j = 0; j < n; ++j) xi[j] = columns[static_cast<std::size_t>(j)].value;
  const double rows = samples(), cost = rows * square(followed_.rmse);
  for (const Equation& e : model.equations) {
    std::vector<int> own, others, present, sign;
    for (int j = 0; j < static_cast<int>(n); ++j) {
      const Column& c = columns[static_cast<std::size_t>(j)];
      if (c.lhs == e.lhs) {
        if (c.estimated) present.push_back(static_cast<int>(own.size()));
        own.push_back(j);
        sign.push_back(sign_of(signs_, e.lhs, c.function));
      } else if (c.estimated) {
        others.push_back(j);
      }
    }
    if (present.empty() || own.size() == present.size()) continue;
    TermCost all = term_cost(followed_.information, followed_.gradient, own, others, xi, cost, rows);
    all.sign = std::move(sign);
    for (const TermSet& set : rival_sets(all, present, margin)) {
      Rival rival{{e.lhs, {}}, set.excess, 0};
      for (std::size_t k = 0; k < set.terms.size(); ++k) {
        Estimate start;
        start.value = set.xi[static_cast<Eigen::Index>(k)];
        const int at = own[static_cast<std::size_t>(set.terms[k])];
        rival.equation.terms.push_back({columns[static_cast<std::size_t>(at)].function, start, ""});
      }
      found.push_back(std::move(rival));
    }
  }
  std::sort(found.begin(), found.end(), [](const Rival& a, const Rival& b) { return a.excess < b.excess; });
  return found;
}

std::vector<Rival> TermSearch::settle_rivals(IdentifiedModel& model) {
  constexpr int kMostRounds = 4;
  constexpr std::size_t kMostTried = 8;
  std::vector<Rival> alike;
  for (int round = 0; round < kMostRounds && !spent(); ++round) {
    alike.clear();
    std::vector<Rival> found = rivals(model, 2 * rules::kOdds150);
    if (found.size() > kMostTried) found.resize(kMostTried);
    bool better = false;
    for (Rival& r : found) {
      if ((better = exchange(model, r))) break;
      if (r.excess < rules::kOdds150) alike.push_back(std::move(r));
    }
    if (!better) break;
  }
  std::sort(alike.begin(), alike.end(), [](const Rival& a, const Rival& b) { return a.excess < b.excess; });
  return alike;
}

}  // namespace whirl::identification::detail
