#pragma once
#include <Eigen/Core>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification::detail {

/// By state of `scores` (of one free run over the whole record): rms by which the intervals of the coefficients and of
/// the dead times, and the noise in what fixes the start, move that run, SI. From draws with a fixed seed. Infinite
/// where a run drawn diverges.
Eigen::VectorXd free_run_spread(const IdentifiedModel& model, const Recording& record,
                                const std::vector<StateScore>& scores);

}  // namespace whirl::identification::detail
