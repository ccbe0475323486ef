#pragma once
#include <vector>

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

}  // namespace whirl::identification::detail
