#include "trajectory/trajectory_runs.hpp"

#include <algorithm>

namespace whirl::identification::detail {

RunRecords runs_of(const SindyOptions& o, const std::vector<Stretch>& smooth) {
  RunRecords runs;
  for (const Stretch& s : smooth) {
    Recording record;
    record.source = s.source;
    record.dt = s.dt;
    record.t0 = s.t0;
    for (std::size_t k = 0; k < o.states.size(); ++k)
      record.add(o.states[k], Quantity::dimensionless, s.raw.col(static_cast<Eigen::Index>(k)));
    for (std::size_t k = 0; k < o.inputs.size(); ++k)
      record.add(o.inputs[k], Quantity::dimensionless, s.inputs.col(static_cast<Eigen::Index>(k)));
    Eigen::MatrixXd x(s.samples(), o.order == 2 ? 2 * s.raw.cols() : s.raw.cols());
    x.leftCols(s.raw.cols()) = s.smooth;
    if (o.order == 2) x.rightCols(s.raw.cols()) = s.rate;
    runs.records.push_back(std::move(record));
    runs.states.push_back(std::move(x));
  }
  return runs;
}

std::vector<TrajectoryRun> cut_trajectory_runs(const RunRecords& runs, Eigen::Index length, Eigen::Index most) {
  std::vector<TrajectoryRun> all;
  for (std::size_t r = 0; r < runs.records.size(); ++r) {
    const Eigen::Index n = runs.records[r].size(), pieces = std::max<Eigen::Index>(1, n / length);
    for (Eigen::Index p = 0; p < pieces; ++p) {
      const Eigen::Index first = p * n / pieces;
      all.push_back({r, first, (p + 1) * n / pieces - first, runs.states[r].row(first)});
    }
  }
  const auto limit = std::max<std::size_t>(2, static_cast<std::size_t>(most / std::max<Eigen::Index>(1, length)));
  if (all.size() <= limit) return all;
  std::vector<TrajectoryRun> spread;
  for (std::size_t k = 0; k < limit; ++k) spread.push_back(all[k * all.size() / limit]);
  return spread;
}

}  // namespace whirl::identification::detail
