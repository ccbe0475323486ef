#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "band.hpp"
#include "whirl/modal/residues.hpp"

namespace whirl::modal {

using Poles = std::vector<std::complex<double>>;

/// Paper eq. 20 with the residues and residuals eliminated: what is left is a function of the poles alone.
struct PoleFit {
  Eigen::MatrixXd residues;  ///< per pole Re a, Im a; then the residuals in use; columns = channels
  Eigen::VectorXd cost;      ///< weighted squared error per channel
  Eigen::MatrixXd jtj;  ///< of (Re p, Im p) per pole, Gauss-Newton with residues eliminated; empty when not asked for
  Eigen::VectorXd jtr;
  Eigen::MatrixXd channel_score;        ///< J^T r of each channel, 2 poles x channels; with the Jacobian only
  Eigen::MatrixXd channel_information;  ///< diagonal of each channel's J^T J
  /// Per group of channels of one weight: coefficients of the derivative columns (per half width) on the columns.
  std::vector<Eigen::MatrixXd> projection;
  Eigen::VectorXd rise;  ///< weighted squared error that comes back when the pole is left out (others refit)

  double total() const { return cost.sum(); }
};

/// Which residual columns follow the poles in `PoleFit::residues`, and what a mode is.
struct ResidualTerms {
  bool lower = true, upper = true, slope = true;
  bool complex = false;     ///< each term has an imaginary factor too
  bool hysteretic = false;  ///< modes a/(s - p) - a/(s + p), k (1 + i eta), instead of conjugate pairs
  Eigen::Index count() const {
    return (Eigen::Index{lower} + Eigen::Index{upper} + Eigen::Index{slope}) * (complex ? 2 : 1);
  }
};

PoleFit fit_poles(const Band& band, const Poles& poles, const ResidualTerms& terms, bool with_jacobian);

/// measured - model on every line and channel, not weighted.
Eigen::MatrixXcd residual_of(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit);

}  // namespace whirl::modal
