#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/pole_fit.hpp"

namespace whirl::modal {

/// A fit whose poles differ a little between FRFs: roving hammers and sensors, mass loading, warming. Every FRF has its
/// own poles p_r + b_kr, b_kr normal with variances `spread`; these are estimated with everything else (mixed-effects
/// model by Laplace's approximation). `local` are the most likely poles of each FRF.
struct ScatterFit {
  Poles poles;                   ///< common, rad/s
  std::vector<Poles> local;      ///< per channel
  Eigen::MatrixXd residues;      ///< as in PoleFit, at the local poles
  Eigen::VectorXd cost;          ///< weighted squared error per channel
  Eigen::VectorXd rise;          ///< as in PoleFit
  Eigen::MatrixXd spread;        ///< poles x 2: variance of Re and Im between FRFs, (rad/s)^2
  double frequency_scatter = 0;  ///< relative sd over all modes; 0 when the data do not show any
  double damping_scatter = 0;    ///< sd of the damping ratio over all modes; 0 when the data do not show any
  double deviance = 0;           ///< -2 log likelihood, up to a constant of the data
  Eigen::MatrixXd covariance;    ///< of (Re, Im) of the common poles
  Eigen::MatrixXcd residual;     ///< measured - model at the local poles
  double correlated = 1;         ///< lines over which what is left hangs together
};

/// Search and selection use every pole's evidence: energies of `least_gain` noise variances per real parameter.
struct ScatterOptions {
  double search_gain = 25;
  double max_damping = 0.1;
  int max_modes = 200;
  double give_up = 1e300;  ///< description length at the start's own poles from which on the fit is not carried on
};

/// Fits poles with scatter, starting from `start`: adds poles that stand out in what is left, drops those that the
/// evidence (-2 log likelihood + log(data) per parameter) does not hold.
ScatterFit fit_scatter(const Band& band, const Poles& start, const ResidualTerms& terms, const ScatterOptions& options);

/// -2 log likelihood + log(data) x parameters; to compare fits of the same band. `lines`: so many count as one.
double description_length(const Band& band, const ScatterFit& fit, const ResidualTerms& terms, double lines = 1);
double description_length(const Band& band, const PoleFit& fit, std::size_t poles, const ResidualTerms& terms,
                          double lines = 1);

/// Lines over which a residual hangs together: 1 for independent noise.
double correlated_lines(const Band& band, const Eigen::MatrixXcd& residual);

}  // namespace whirl::modal
