#pragma once
#include <functional>
#include <vector>

#include "whirl/sindy/compare.hpp"

namespace whirl::detail {

/// `fit` with every method of `solve`, timed; a method that cannot be used on `terms` columns says so.
std::vector<ComparedFit> compare_all(std::size_t terms, const SolveOptions& options,
                                     const std::function<IdentifiedModel(const SolveOptions&)>& fit);

}  // namespace whirl::detail
