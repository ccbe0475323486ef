#pragma once
#include <map>
#include <string>
#include <vector>

#include "problem/shooting_runs.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification::detail {

/// +1 or -1 of the bounded candidates, by left-hand side and function.
using Signs = std::map<std::string, std::map<std::string, int>>;

/// Bounds as asked for, on the candidates they mean. Throws Error, with the terms there are, on one that means none.
Signs resolve_signs(const std::vector<SignBound>& bounds, const Candidates& candidates);
/// 0: free.
int sign_of(const Signs& signs, const std::string& lhs, const std::string& function);

/// Bounded terms that the fit left out and that least squares beside its terms would give the other sign, with at least
/// `t_value`.
std::vector<TermScore> blocked_terms(const regression::Problem& problem, const regression::SparseFit& fit,
                                     const std::vector<int>& sign, const std::string& lhs, double t_value);

/// Cuts the intervals of bounded terms at their bound, tells what became of every bound and warns of active ones.
std::vector<BoundOutcome> conclude_bounds(const Signs& signs, const std::vector<TermScore>& blocked,
                                          IdentifiedModel& model);

}  // namespace whirl::identification::detail
