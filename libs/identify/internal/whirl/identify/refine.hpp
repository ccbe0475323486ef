#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::identification {

/// A stretch of measurement to be reproduced by a free run.
struct FreeRun {
  Eigen::VectorXd start;  ///< states at the first sample, in the order of CompiledModel::states()
  /// One column per CompiledModel::inputs(), 2 k (samples - 1) + 1 rows for k Runge-Kutta steps a sample: their values
  /// at the ends and the middle of each.
  Eigen::MatrixXd inputs;
  Eigen::MatrixXd measured;  ///< samples x outputs; NaN: not measured
};

struct RefineOptions {
  std::vector<std::string> outputs;  ///< states measured, one per column of FreeRun::measured
  Eigen::VectorXd output_sd = {};    ///< noise sd per output; empty: all equal
  /// Correlation of the noise of each output from sample to sample; then output_sd is that of what is new in every
  /// sample, and residuals are weighed as such. Empty: white.
  Eigen::VectorXd output_correlation = {};
  Eigen::Index skip = 0;   ///< samples at the start of every run that do not count
  bool free_start = true;  ///< estimate the start of every run
  /// Ties: coefficients of the estimated terms (in the order of equations and terms) = ties * unknowns; empty: none.
  Eigen::MatrixXd ties = {};
  /// Runge-Kutta steps per sample; 0: as many, up to 16, as keep the error of the free runs below a quarter of the
  /// standard deviation of any estimate; runs with inputs take as many as these are given for.
  int substeps = 0;
  int max_iterations = 30;
  double tolerance = 1e-7;  ///< stop when an iteration lowers the error by less than this share
};

/// A term that is not in the model, and what it would be worth there.
struct TermScore {
  std::string equation;  ///< lhs
  std::string function;
  /// Fall of the residual sum of squares in units of the residual variance when the term is added, to first order: chi
  /// square with 1 degree of freedom for a term that is not needed and white residuals.
  double score = 0;
  double coefficient = 0;  ///< of that first-order step
};

struct Refined {
  IdentifiedModel model;                ///< new coefficients with standard deviations
  std::vector<Eigen::VectorXd> starts;  ///< per run
  Eigen::MatrixXd covariance;   ///< of the estimated coefficients, in the order of equations and terms; of the unknowns
                                ///< where there are ties
  double rmse = 0;              ///< of all outputs, weighted by output_sd
  Eigen::VectorXd output_rmse;  ///< of each output, weighted by output_sd
  Eigen::VectorXd output_rows;  ///< values compared
  Eigen::MatrixXd autocorrelation;  ///< of the weighted residuals, outputs x lags from 1 on
  int iterations = 0;
  int passes = 0;                 ///< simulations of all runs with their sensitivities: the cost
  bool converged = false;         ///< false also when the starting model diverges
  std::vector<TermScore> scores;  ///< of the candidates asked for, largest first
  /// With candidates: J'J and J'r of the weighted residuals r over the estimated coefficients, then the candidates in
  /// the order given, at the solution and with the best starts for each.
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

/// Output-error (simulation-error) refinement: minimises sum over runs and samples of (measured - free run)^2 over all
/// coefficients whose sd is not exactly 0 (those are known, e.g. x' = v) and the starts. Levenberg-Marquardt with exact
/// forward sensitivities, S' = (df/dx) S + df/dtheta, integrated with the states by the same steps.
/// Source: Ljung, System Identification, 1999, section 10.2; notation of the score test: Rao 1948.
///
/// With ties the starting coefficients must obey them. `candidates` (without ties only): equations with terms to be
/// scored at the solution (coefficients ignored). A run that diverges at the start values gives converged = false and
/// the model unchanged. Throws Error when sizes or names do not fit.
Refined refine_free_run(const IdentifiedModel& model, const std::vector<FreeRun>& runs, double dt,
                        const RefineOptions& options, const std::vector<Equation>& candidates = {});

}  // namespace whirl::identification
