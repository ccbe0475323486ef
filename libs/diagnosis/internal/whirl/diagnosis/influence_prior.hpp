#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// What is known of the influence coefficients before a trial run: from a model, its uncertainty in it, or from an
/// earlier job on a machine of this kind. Complex Gaussian, all coefficients together: what they have in common (modal
/// mass, damping, gain and angle of the probes) is what a trial on one plane tells about the others.
struct InfluencePrior {
  Eigen::MatrixXcd mean;        ///< rows x planes, m per unit of mass
  Eigen::MatrixXcd covariance;  ///< of vec(influence), column after column, Hermitian, E (a - mean)(a - mean)^H
  /// Throws Error when sizes do not fit or a value is not finite.
  void check(Eigen::Index rows, Eigen::Index planes) const;
};

/// a = mean (1 + g + e): g one relative error of all coefficients of a speed, e one of each; `common` and `each` are
/// their sd (of the complex number), `speed` of each row.
InfluencePrior relative_prior(const Eigen::MatrixXcd& mean, double common, double each, const std::vector<int>& speed);

/// From equally likely models (draws from the covariance of an identification, and each of its readings where it is
/// ambiguous): mean and covariance of their coefficients. `floor`: relative sd of each coefficient beyond the
/// ensemble's, for what every model leaves out. Throws Error for fewer than two models.
InfluencePrior ensemble_prior(const std::vector<Eigen::MatrixXcd>& models, double floor = 0.05);

/// Correction from runs and prior together.
struct BayesianBalance {
  Eigen::MatrixXcd influence;    ///< posterior mean
  Eigen::MatrixXd influence_sd;  ///< per component
  Eigen::VectorXcd baseline;     ///< posterior mean, as found
  Eigen::VectorXcd masses;       ///< that make the expected sum of squares smallest, the uncertainty in it
  /// By plane: 2.5 to 97.5 % of the best masses over draws of the posterior.
  std::vector<Estimate> real, imag, magnitude, angle;
  std::vector<Estimate> residual;  ///< predicted |reading| with `masses`: median, 2.5 to 97.5 %
  double surprise = 0;             ///< chi-square of the runs under the prior over its degrees of freedom
  Summary summary;
};

/// `noise`: sd of one reading per component, m, > 0. Without drift. Throws Error as job.check(), and when no run was
/// made.
BayesianBalance balance_with_prior(const BalancingJob& job, const InfluencePrior& prior, double noise, int draws = 2000,
                                   unsigned seed = 1);

}  // namespace whirl::diagnosis
