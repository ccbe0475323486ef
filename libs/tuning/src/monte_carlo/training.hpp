#pragma once
#include <functional>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// Cost of a policy on random machines before and after its training.
struct Training {
  std::vector<double> best;      ///< variables in [0, 1]
  long runs = 0;                 ///< closed-loop runs of machines, those of `before` and `after` included
  double before = 0, after = 0;  ///< mean tuning_cost of the start and of `best` on machines not trained on
};

/// Policy search by trial: a separable covariance matrix adaptation (sep-CMA-ES, R. Ros and N. Hansen, PPSN X, 2008) of
/// the variables in [0, 1], each candidate tried on the same 16 random machines of its generation (RigDraw: what
/// `robustness` draws, stiffness, unbalance and actuators scattered three times as much), which are new in each. `make`
/// gives the design of a candidate. Ends after `runs` closed-loop runs; the start is returned when nothing better was
/// found. The result does not depend on the number of threads.
Training train(const std::function<ControllerDesign(const std::vector<double>&)>& make, std::vector<double> start,
               const IdentifiedModel& model, const Hardware& hardware, long runs, std::uint64_t seed, int threads,
               const std::function<void(double)>& progress);

}  // namespace whirl::tuning
