#include "output_error/model_terms.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {

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
          crosses ? -1
                  : std::min(std::abs(c.value) / c.sd / options.search.t_value, share / options.search.least_share);
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

}  // namespace whirl::identification::detail
