#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace whirl::modal {

/// Spectra of one blow, on the lines that the hammer excites.
struct BlowSpectra {
  Eigen::VectorXcd force;
  std::vector<Eigen::VectorXcd> responses;
};

/// What sets a blow apart from the others, per blow: empty when it agrees. `names` of the responses, `dt` of the
/// record, `samples` of one transform. Needs two blows; with two only, both are named, since nothing tells which is
/// wrong.
struct BlowDisagreement {
  std::string finding;
  bool certain = false;  ///< most of the blows agree with one another and this one does not
};
std::vector<std::vector<BlowDisagreement>> judge_blows(const std::vector<BlowSpectra>& blows,
                                                       const std::vector<std::string>& names, double dt,
                                                       Eigen::Index samples);

/// Which blows agree in every response, by correlation and a gain within 30 % at no delay.
struct BlowGroups {
  std::size_t largest = 0;  ///< blows of the largest group that agrees with one of its own (correlation above 0.5)
  bool all_paired =
      true;  ///< each blow has another that it resembles (above 0.8): what sets the rest apart is no noise
};
/// Half of the blows or fewer in the largest group: they are not those of one point, or noise.
BlowGroups groups_of(const std::vector<BlowSpectra>& blows);

}  // namespace whirl::modal
