#pragma once
#include "whirl/modal/frf.hpp"

namespace whirl::modal {

/// Main pulse of a force record: samples [first, last] above 10 % of the peak; [0, quiet) is safely before it.
struct Pulse {
  Eigen::Index first = 0, last = 0, peak = 0, quiet = 0;
  double sign = 1;  ///< of the force at the peak
  Eigen::Index width() const { return last - first + 1; }
};
Pulse find_pulse(const Eigen::Ref<const Eigen::VectorXd>& force);

/// Single samples of a force far off its neighbours, where its pulses are three samples wide or more: lost bits or a
/// loose contact, no blows. Empty where the sampling is too slow to tell.
std::vector<Eigen::Index> force_spikes(const Eigen::Ref<const Eigen::VectorXd>& force);

}  // namespace whirl::modal
