#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "fit/fit_model.hpp"
#include "fit/sweep/sweep.hpp"
#include "whirl/core/least_squares.hpp"

namespace whirl::shaft {

/// Where a descent stands.
struct FitPoint {
  Eigen::VectorXd t;
};

/// Residual of one run: measured less model, in standard deviations of real and imaginary part.
struct RunResidual {
  Eigen::MatrixXcd value;  ///< probes x blocks
};

/// The fit as a problem of `descend`: all unknowns together, those that act linearly (unbalance, bow, gain, runout)
/// solved anew at every trial of the structural ones. That leaves fewer false minima than moving all by one step (Golub
/// and Pereyra, Inverse Problems 19, 2003, R1-R26).
class FitProblem {
 public:
  FitProblem(std::shared_ptr<FitModel> model, const std::vector<OrderRun>& runs);

  void linearise(FitPoint& p, SquareSum& s);
  void last(FitPoint& p, SquareSum& s) { linearise(p, s); }
  FitPoint moved(const FitPoint& p, const Eigen::VectorXd& step) const;
  bool small(const SquareSum& s, const Eigen::VectorXd& step, double decrease) const;

  /// Standard deviation of the record of a probe in a run, m: weights of the residuals.
  void set_noise(std::size_t run, Eigen::Index probe, double sd) { noise_[run][probe] = sd; }
  double noise(std::size_t run, Eigen::Index probe) const { return noise_[run][probe]; }
  /// Noise as the runs themselves show it, before any model (`scatter`).
  void reset_noise();
  /// A model about other values.
  void set_model(std::shared_ptr<FitModel> model) { model_ = std::move(model); }
  const FitModel& model() const { return *model_; }
  const std::vector<OrderRun>& runs() const { return runs_; }
  /// Of the last linearisation.
  const std::vector<RunResidual>& residuals() const { return residuals_; }
  /// The last linearisation without the tolerances of the file: information of the records.
  const Eigen::MatrixXd& information() const { return information_; }
  /// Information of the records at given values, nothing moved.
  Eigen::MatrixXd information_at(const Eigen::VectorXd& t);
  /// Real residuals, priors not counted.
  Eigen::Index equations() const;

 private:
  struct RunState {
    std::vector<SteadyPoint> steady;
    Eigen::MatrixXcd readings;  ///< (probes columns) x blocks, steady and swept
    Eigen::MatrixXcd conjugate;
  };
  void evaluate(const Eigen::VectorXd& t);
  void refine_linear(Eigen::VectorXd& t);
  void share_scale(Eigen::VectorXd& t) const;
  template <class Row>
  void visit(const Eigen::VectorXd& t, bool slopes, Row&& row);
  double weight(std::size_t run, Eigen::Index probe, Eigen::Index block) const;

  std::shared_ptr<FitModel> model_;
  const std::vector<OrderRun>& runs_;
  std::vector<Eigen::VectorXd> noise_;  ///< per run
  SweepModes modes_;
  std::vector<RunState> states_;
  std::vector<RunResidual> residuals_;
  Eigen::MatrixXd information_;
};

/// Standard deviation of the record of each probe by the scatter of a run's vectors from block to block: third
/// differences, in which a smooth course over speed is small, by their median.
Eigen::VectorXd scatter(const OrderRun& run);

}  // namespace whirl::shaft
