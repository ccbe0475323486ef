#pragma once
#include <vector>

#include "problem/shooting_runs.hpp"
#include "problem/sign_bounds.hpp"
#include "whirl/core/identified_model.hpp"

namespace whirl::identification::detail {

/// A term of a model that the records do not ask for.
struct Weak {
  std::size_t equation, term;
  double worth;  // below 1: to be dropped
};

/// Terms below the limits or across their sign bound, least worth first.
std::vector<Weak> weak_terms(const IdentifiedModel& model, const Shares& shares, const Signs& signs,
                             const SindyOptions& options);
void drop(IdentifiedModel& model, std::vector<Weak> weak);

/// Candidates that the equations of the model do not have, by equation.
std::vector<Equation> absent_terms(const IdentifiedModel& model, const Candidates& candidates);

/// Whether the large equation has every term of the small one.
bool within(const Equation& small, const Equation& large);

}  // namespace whirl::identification::detail
