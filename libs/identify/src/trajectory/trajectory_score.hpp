#pragma once
#include <vector>

#include "whirl/identify/sindy.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {

/// States that are neither channels of the record nor rates of one.
std::vector<std::string> hidden_states(const IdentifiedModel& model, const Recording& record);
/// Has the model inputs with a hold or a dead time, or hidden states? Then the half-sample grid does not do.
bool needs_trajectory(const IdentifiedModel& model, const Recording& record);

/// `simulate` and `score` for such models. The start of hidden states is fitted over the first characteristic periods.
ModelRun simulate_trajectory(const IdentifiedModel& model, const Recording& record);
std::vector<StateScore> score_trajectory(const IdentifiedModel& model, const Recording& record, double horizon);

/// States at sample `at`: smoothed channels, their rates, 0 for hidden states.
Eigen::MatrixXd rough_states(const TrajectoryModel& model, const Recording& record);
/// Moves the start of a run to where its first `fitted` samples are followed best, all else as it is.
void fit_start(const TrajectoryModel& model, const Recording& record, Eigen::Index fitted, TrajectoryRun& run);

}  // namespace whirl::identification::detail
