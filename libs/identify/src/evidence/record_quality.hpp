#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::identification::detail {

/// Throws Error when there is no record or their sample times differ.
void require_equal_steps(const std::vector<Recording>& records);

/// Reasons why these channels cannot give equations, each as a failure of `summary`: a channel that is zero or constant
/// over all records, of a size whose powers leave the range of doubles, mostly noise (states of differential equations
/// only), or the same signal as another one. NaN samples are gaps.
void check_signals(const std::vector<Recording>& records, const std::vector<std::string>& states,
                   const std::vector<std::string>& inputs, bool discrete, Summary& summary);

}  // namespace whirl::identification::detail
