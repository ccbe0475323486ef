#pragma once
#include <Eigen/Core>

#include "output_error/sindy_refine.hpp"
#include "problem/sindy_prepare.hpp"

namespace whirl::identification::detail {

/// Noise sd per state as weight of the refinement; below 1e-6 of the signal the integration error of the samples, not
/// the noise, limits the fit, and `noisy` is false. Of noise that is correlated from sample to sample: sd of what is
/// new in every sample.
struct OutputWeights {
  Eigen::VectorXd sd;
  bool noisy = true;
  Eigen::VectorXd correlation = {};  ///< per state; empty: white
  double correlation_of(Eigen::Index k) const { return correlation.size() > 0 ? correlation[k] : 0; }
};
OutputWeights output_weights(const SindyData& data, const Eigen::VectorXd& correlation = {});

/// Verdict on equations that stand by regression alone (maps, or without refinement): `summary.residual` is the share
/// of the left-hand side that no term explains.
void judge_regression(const SindyData& data, IdentifiedModel& model);

/// Verdict after refinement; `least`: of the regression before it.
void judge_refined(const SindyData& data, const OutputWeights& weights, const Followed& followed,
                   const LeastExplained& least, IdentifiedModel& model);

}  // namespace whirl::identification::detail
