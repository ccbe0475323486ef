#pragma once
#include <functional>
#include <vector>

#include "whirl/identify/compare.hpp"

namespace whirl::identification::detail {

/// `fit` with every method of `solve`, timed; a method that cannot be used on `terms` columns says so.
std::vector<ComparedFit> compare_all(std::size_t terms, const regression::SolveOptions& options,
                                     const std::function<IdentifiedModel(const regression::SolveOptions&)>& fit);

}  // namespace whirl::identification::detail
