#pragma once
#include <Eigen/Core>
#include <vector>

#include "output_error/output_error.hpp"
#include "output_error/sensitivity.hpp"
#include "whirl/identify/refine.hpp"

namespace whirl::identification::detail {

/// Coefficients and starts of a fit of equations, and what their free runs leave.
struct StatesPoint {
  Eigen::VectorXd theta;                ///< of the free terms
  std::vector<Eigen::VectorXd> starts;  ///< per run
  Eigen::VectorXd cost_of, rows_of;     ///< weighted squares and values compared, per output
  Eigen::MatrixXd lag_of;               ///< products of weighted residuals 1 to kLags samples apart, per output
};

/// Equations x' = sum theta f(x, u) as a problem of output error. Unknowns: coefficients of the free terms, or what
/// they are tied to, then the start of each run.
class StatesProblem {
 public:
  /// `outputs`: index of the state that each column of FreeRun::measured shows.
  StatesProblem(SensitivitySystem system, const std::vector<FreeRun>& runs, double dt,
                std::vector<Eigen::Index> outputs, const RefineOptions& options);

  static constexpr Eigen::Index kLags = 12;

  StatesPoint start() const;
  double values() const { return values_; }
  Eigen::Index coefficients() const { return tied_ ? options_.ties.cols() : system_.parameters(); }
  /// Linearisations so far: the cost of a fit.
  int passes() const { return passes_; }

  void linearise(StatesPoint& p, SquareSum& sum);
  void last(StatesPoint& p, SquareSum& sum) { linearise(p, sum); }
  StatesPoint moved(const StatesPoint& p, const Eigen::VectorXd& step) const;
  bool small(const SquareSum& sum, const Eigen::VectorXd&, double decrease) const {
    return decrease <= options_.tolerance * sum.cost;
  }

 private:
  bool follow(std::size_t r, StatesPoint& p, SquareSum& run);

  SensitivitySystem system_;
  const std::vector<FreeRun>& runs_;
  std::vector<Eigen::MatrixXd> inputs_;  // per run: one contiguous column per half step
  double dt_;
  std::vector<Eigen::Index> outputs_;
  Eigen::VectorXd weight_, correlation_;  // per output
  const RefineOptions& options_;
  bool tied_;
  double values_ = 0;
  int passes_ = 0;
};

}  // namespace whirl::identification::detail
