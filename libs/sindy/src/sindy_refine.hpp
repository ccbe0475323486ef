#pragma once
#include <vector>

#include "shooting_runs.hpp"
#include "whirl/core/identified_model.hpp"

namespace whirl::detail {

/// Multiple-shooting refinement with pruning, score test and exchange of supports (step 3 of fit_sindy). `sd`: noise per
/// state; `alternatives`: other right-hand sides that the regression found for an equation. Returns the length of the free
/// runs that the model still follows, s; 0 when it follows none and was not refined.
double refine_and_select(IdentifiedModel& model, const Candidates& candidates, const std::vector<Equation>& alternatives,
                       const std::vector<Stretch>& stretches, const Eigen::VectorXd& sd, double characteristic_rate,
                       const SindyOptions& options);

}  // namespace whirl::detail
