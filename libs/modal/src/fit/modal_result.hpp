#pragma once
#include "fit/scatter/scatter.hpp"
#include "white_fit.hpp"

namespace whirl::modal {

/// What fit_modes has decided on.
struct Solution {
  Poles poles;
  Eigen::MatrixXd residues;                 ///< as in PoleFit
  Eigen::MatrixXcd residual;                ///< measured - model
  std::vector<Eigen::MatrixXd> covariance;  ///< of (Re, Im) of the poles; the widest counts; empty when not refined
  std::vector<Tie> ties = {};               ///< of the last poles
  double correlated = 1;
  bool converged = false;
  ResidualTerms terms;
  std::vector<Poles> local;  ///< poles of each channel, where they differ
  Eigen::MatrixXd spread;    ///< as in ScatterFit
  double frequency_scatter = 0, damping_scatter = 0;
  double length = 0;          ///< description length with the weights: compares fits under other weights
  bool damping_open = false;  ///< viscous, but the residues are turned as by structural damping
};

/// The model of a solution, with its warnings.
ModalModel to_model(const FrequencyResponse& frf, const Band& band, const Solution& solution);

}  // namespace whirl::modal
