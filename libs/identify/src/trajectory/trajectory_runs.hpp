#pragma once
#include <vector>

#include "trajectory/trajectory_system.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {

/// Finite stretches of records, as trajectories take them, and the states to start from at every sample.
struct RunRecords {
  std::vector<Recording> records;
  std::vector<Eigen::MatrixXd> states;  ///< per record, samples x states: measured ones, then their rates (order 2)
};

RunRecords runs_of(const SindyOptions& options, const std::vector<Stretch>& smooth);

/// Runs of about `length` samples; at most about `most` samples in all, spread evenly.
std::vector<TrajectoryRun> cut_trajectory_runs(const RunRecords& runs, Eigen::Index length, Eigen::Index most);

/// What every run alone says: unknowns free parameters, then the run's start. A run that diverges says so.
std::vector<TrajectorySums> sums_by_run(const TrajectoryModel& model, const std::vector<Recording>& records,
                                        const std::vector<TrajectoryRun>& runs, const Eigen::VectorXd& output_sd);

}  // namespace whirl::identification::detail
