#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// A state of the rotor (runs that are near-repeats of each other) foretold by the runs of all other states.
struct LeftOutState {
  std::vector<int> runs;
  bool told = false;          ///< the others tell every plane's influence
  Eigen::VectorXcd foretold;  ///< by row, m zero-to-peak, lead
  Eigen::VectorXcd measured;  ///< mean of its runs; NaN where nothing was read
  double error = 0;           ///< rms of |measured - foretold| over the rows, m; NaN when not told
};

struct LeaveStatesOut {
  std::vector<LeftOutState> states;
  double error = 0;  ///< rms over all readings of the states that are told, m; NaN without one
  double share = 0;  ///< of the rms reading of these states
};

/// Leave-one-state-out error (cross-validation) of the fit: each state is foretold by the others, with the runs and the
/// drift of `fit`. Unlike the residual, it cannot be made small by more unknowns.
LeaveStatesOut leave_states_out(const BalancingJob& job, const InfluenceFit& fit);

}  // namespace whirl::diagnosis
