#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {

/// Terms that the record can hardly tell apart: their columns are nearly linearly dependent.
struct CollinearGroup {
  std::string equation;            ///< lhs; empty for parameters shared by all equations
  std::vector<std::string> terms;  ///< at least two
  double condition_index = 0;      ///< largest over this singular value of the columns scaled to length 1
};

/// Groups among columns with Gram matrix `gram`: for every condition index above `limit` (30: Belsley, Kuh and Welsch
/// 1980, section 3.2) the columns that make up more than a fifth of the singular vector.
std::vector<CollinearGroup> collinear_groups(const Eigen::MatrixXd& gram, const std::vector<std::string>& names,
                                             double limit = 30);
/// Groups among the terms kept in each equation of `model`, evaluated on the record (states smoothed, rates from the
/// smoothing spline); of a rotor with known covariance, among its parameters k1, k2, c, eps_re, eps_im.
std::vector<CollinearGroup> collinear_groups(const IdentifiedModel& model, const Recording& record);

/// Samples `first` .. `first + count - 1` of a record; t0 follows.
Recording part_of(const Recording& record, Eigen::Index first, Eigen::Index count);

/// Data to fit and data to predict.
struct HoldoutSplit {
  std::vector<Recording> train;
  Recording test;
  std::string what;  ///< e.g. "the last 30 % of run.csv"
};
/// Several records: the last is held out. One record: its last part, from the sample where a share 1 - `share` of the
/// energy of `energy` channels (about their mean) has passed, or, without such channels, of the time. Of accelerations
/// it is the energy of the velocity, by the speed of the channel `angle`: that of a resonance, not that of the top
/// speed.
HoldoutSplit split_holdout(const std::vector<Recording>& records, double share = 0.3,
                           const std::vector<std::string>& energy = {}, const std::string& angle = "");

/// The same of one record by its number of samples: first sample held out by time, and the description.
Eigen::Index holdout_start(Eigen::Index samples, double share);
std::string held_out_part(Eigen::Index first, Eigen::Index samples, const std::string& source);

/// Free-run prediction of data that was not used for the fit.
struct HeldOut {
  std::string what;                ///< what was held out
  std::vector<StateScore> scores;  ///< of one free run from the first sample
  double horizon = 0;              ///< s; > 0: `near` holds free runs restarted so often
  std::vector<StateScore> near;
  std::string reason;     ///< why there are no scores; empty when there are
  std::string unit = {};  ///< of errors and noise where they are not those of displacements or of states; empty: SI
};

}  // namespace whirl::identification
