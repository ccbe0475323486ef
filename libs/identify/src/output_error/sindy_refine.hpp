#pragma once
#include <vector>

#include "problem/shooting_runs.hpp"
#include "problem/sign_bounds.hpp"
#include "whirl/core/identified_model.hpp"

namespace whirl::identification::detail {

/// Another right-hand side of one equation that the records cannot tell from the model's.
struct Alike {
  Equation equation;
  double chi_square = 0;  ///< that free runs with it leave
};

/// How far free runs of a refined model follow the records.
struct Followed {
  double horizon = 0;                    ///< length of the runs, s; 0: the model follows none and was not refined
  Eigen::VectorXd output_rmse;           ///< of each state in units of `sd`; empty with horizon 0
  Eigen::VectorXd output_rows = {};      ///< values compared
  Eigen::MatrixXd autocorrelation = {};  ///< of the weighted residuals, states x lags from 1 on
  Eigen::MatrixXd covariance = {};       ///< of the estimated coefficients, in the order of equations and terms
  std::vector<TermScore> blocked = {};   ///< terms that only their sign bound keeps out
  bool between_samples = false;    ///< inputs act as band-limited signals between samples, in steps finer than these
  std::vector<Alike> rivals = {};  ///< best first
};

/// Multiple-shooting refinement with pruning, score test and exchange of supports (step 3 of fit_sindy). `sd`: noise
/// per state, with options.noise_correlation what is new in it from sample to sample; `alternatives`: other right-hand
/// sides that the regression found for an equation.
Followed refine_and_select(IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
                           const std::vector<Equation>& alternatives, const std::vector<Stretch>& stretches,
                           const Eigen::VectorXd& sd, double characteristic_rate, const SindyOptions& options);

}  // namespace whirl::identification::detail
