#pragma once
#include <optional>
#include <vector>

#include "evidence/sindy_verdict.hpp"
#include "problem/sindy_prepare.hpp"
#include "trajectory/input_lag.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {

/// Coefficients, holds, dead times and, with a lag, its time by free runs. Models of a lag are as `with_lag` gives
/// them.
class Timer {
 public:
  Timer(const std::vector<Recording>& records, const SindyOptions& options, std::optional<InputLag> lag = {});

  TrajectoryFit fit(const IdentifiedModel& model, const std::vector<InputTiming>& timing, Eigen::Index length,
                    Eigen::Index most, int iterations) const;
  /// The same; where that does not converge or follow, by way of runs of one period, and by these alone (`length` then
  /// says so) where longer ones do not follow yet.
  TrajectoryFit approach(const IdentifiedModel& model, const std::vector<InputTiming>& timing, Eigen::Index& length,
                         Eigen::Index most, int iterations) const;
  /// Drops terms that exact holds make needless, then fits longer and longer runs while they still follow.
  TrajectoryFit settle(IdentifiedModel& model, std::vector<InputTiming> timing, Eigen::Index& length) const;
  void judge(const TrajectoryFit& fit, Eigen::Index length, IdentifiedModel& model) const;
  Eigen::Index period() const { return period_; }
  bool noisy() const { return weights_.noisy; }

 private:
  bool drop_weakest(IdentifiedModel& model, const Shares& shares) const;
  bool of_lag(const Equation& e) const { return lag_ && e.lhs == lag_->state() + "'"; }
  Equation in_candidates(const Equation& e) const;

  const SindyOptions& options_;
  std::optional<InputLag> lag_;
  SindyData data_;
  std::vector<Stretch> untouched_;
  RunRecords runs_;
  OutputWeights weights_;
  Eigen::Index period_ = 0;
};

}  // namespace whirl::identification::detail
