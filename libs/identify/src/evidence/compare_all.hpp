#pragma once
#include <functional>
#include <vector>

#include "whirl/identify/compare.hpp"

namespace whirl::identification::detail {

/// `fit` with every method of `solve`, timed; a method that cannot be used on `terms` columns says so.
std::vector<ComparedFit> compare_all(std::size_t terms, const regression::SolveOptions& options,
                                     const std::function<IdentifiedModel(const regression::SolveOptions&)>& fit);

/// `fit` as a line of the comparison: its terms and processor time; an Error makes the model unusable.
ComparedFit timed_fit(const std::string& name, const std::function<IdentifiedModel()>& fit);

}  // namespace whirl::identification::detail
