#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::identification {

/// A number of a trajectory model that may be estimated.
struct TrajectoryParameter {
  std::string name;  ///< as it stands in the rates
  double value = 0;
  bool free = true;
  double low = -1e300, high = 1e300;  ///< the estimate stays within
};

/// x' = f(x, u, theta), y = h(x, u, theta): any right-hand side, nonlinear in its parameters too. States need no
/// channel: those that no output names are hidden.
struct TrajectoryModel {
  std::vector<std::string> states;
  std::vector<expr::Expr> rates;  ///< one per state, in states, inputs, parameters and t
  std::vector<std::string> inputs;
  std::vector<TrajectoryParameter> parameters;
  std::vector<std::string> channels;  ///< measured, one per output
  std::vector<expr::Expr> outputs;    ///< what each channel shows, in states, inputs and parameters
  std::vector<InputTiming> timing;    ///< of inputs, by name; absent: band-limited without dead time
};

/// A stretch of a record that a free run has to follow. Inputs are those of the whole record, so that a dead time finds
/// what came before.
struct TrajectoryRun {
  std::size_t record = 0;
  Eigen::Index first = 0, count = 0;  ///< samples
  Eigen::VectorXd start;              ///< states at the first of them
};

struct TrajectoryOptions {
  Eigen::VectorXd output_sd = {};  ///< noise sd per channel; empty: all equal
  /// Per state: may a run's start be estimated? Empty: all.
  std::vector<bool> free_start = {};
  /// Sd of a prior about the given start, per state; 0 or empty: none.
  Eigen::VectorXd start_sd = {};
  /// Multiple shooting: sd allowed, per state, between the end of a run and the start of the next of the same record;
  /// empty: runs are independent.
  Eigen::VectorXd gap_sd = {};
  std::vector<std::string> free_dead_time = {};  ///< inputs whose dead time is estimated, from that in `timing`
  double most_dead_time = 0;                     ///< s; 0: 50 samples
  std::vector<std::string> scored = {};          ///< parameters that stay; what each would be worth is told
  /// Runge-Kutta steps per sample; 0: as many, up to 16, as the fastest rate of the model asks for and as keep their
  /// error below a quarter of the standard deviation of any estimate.
  int substeps = 0;
  int max_iterations = 30;
  double damping = 0;       ///< of the first step (Levenberg): above 0 where the values given may be far off
  double tolerance = 1e-6;  ///< stop when an iteration lowers the error by less than this share
};

/// What a parameter that was held would be worth, to first order.
struct TrajectoryScore {
  std::string name;
  double score = 0;  ///< fall of the sum of squares in units of the residual variance (Rao 1948)
  double step = 0;   ///< change of the parameter that brings it
};

struct TrajectoryFit {
  TrajectoryModel model;            ///< new parameter values and timing
  std::vector<TrajectoryRun> runs;  ///< new starts
  /// Of the free parameters, then the dead times, from the residual variance.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd output_rmse;          ///< per channel, in its unit
  double rmse = 0;                      ///< of all channels, weighted by output_sd
  double cost = 0;                      ///< sum of weighted squares of what is measured (without prior and gaps)
  Eigen::Index rows = 0;                ///< values compared
  std::vector<TrajectoryScore> scores;  ///< of options.scored, largest first
  int iterations = 0;
  bool converged = false;
  bool diverged = false;  ///< the free runs of the model given do: nothing was done
};

/// Least squares of free runs against records over parameters, dead times and starts, by Levenberg-Marquardt with exact
/// forward sensitivities. Inputs are taken as their hold says: steps of Runge-Kutta order 4 end wherever an input
/// switches, so that a zero-order hold with any dead time is exact. Sensitivity to a dead time: f before minus f after
/// at every switch of a held input, -df/du u' for smooth ones.
///
/// Source: Ljung, System Identification, 1999, section 10.2; multiple shooting with gaps as rows: Bock 1983; jumps of
/// sensitivities at switches: Rozenvasser 1967. Records must have one sample time. Throws Error for names and sizes
/// that do not fit.
TrajectoryFit fit_trajectory(const TrajectoryModel& model, const std::vector<Recording>& records,
                             const std::vector<TrajectoryRun>& runs, const TrajectoryOptions& options = {});

/// Channels that the model predicts over a run (count x channels) and, where asked for, its states. Empty when the run
/// diverges.
Eigen::MatrixXd follow(const TrajectoryModel& model, const Recording& record, const TrajectoryRun& run,
                       int substeps = 0, Eigen::MatrixXd* states = nullptr);

/// An identified model with every coefficient a parameter, named "lhs: function"; free where its sd is not 0. Outputs:
/// the states in `channels`.
TrajectoryModel trajectory_model(const IdentifiedModel& model, const std::vector<std::string>& channels);
/// Coefficients, intervals and timing of a fit put back into the model that it came from.
void take_over(const TrajectoryFit& fit, IdentifiedModel& model);

}  // namespace whirl::identification
