#pragma once
#include <vector>

#include "influence_fit.hpp"

namespace whirl::diagnosis {

/// Runs with nearly the same masses (kNearMass, kNearAngle), in groups; a run alone is a group.
std::vector<std::vector<std::size_t>> near_repeats(const BalancingJob& job, const std::vector<bool>& used);

struct RepeatScatter {
  double sd = 0;     ///< per component of a reading, m; NaN without near-repeats
  double share = 0;  ///< root of the mean |difference|^2 from the mean of the group, over the rms reading; NaN
  std::vector<std::size_t> worst;  ///< the group that differs most
};
/// Of the near-repeats among fit.used; drift and the effect of the small differences of their masses taken off.
RepeatScatter repeat_scatter(const BalancingJob& job, const InfluenceFit& fit, const RunDesign& design);

}  // namespace whirl::diagnosis
