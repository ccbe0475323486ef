#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification::detail {

/// A first-order lag between an input and the system, behind hold and dead time: an actuator. T y' = u(t - dead) - y.
struct InputLag {
  InputTiming timing;  ///< of the input before the lag
  double time = 0;     ///< s, T
  /// Name of the state that acts on the system.
  std::string state() const { return timing.input + "_acting"; }
};

/// What acts on the system at every sample of an input; at rest with the first one of every stretch without a gap.
Eigen::VectorXd acting(const Eigen::Ref<const Eigen::VectorXd>& samples, double dt, const InputLag& lag);
/// The records with what acts on the system in place of the input.
std::vector<Recording> with_input_acting(const std::vector<Recording>& records, const InputLag& lag);
/// The model with `lag.state()` in place of the input, and its equation.
IdentifiedModel with_lag(const IdentifiedModel& model, const InputLag& lag);
/// A term of it as it reads in the input.
std::string in_input(const std::string& function, const InputLag& lag);

}  // namespace whirl::identification::detail
