#pragma once
#include <optional>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/rotation.hpp"

namespace whirl::diagnosis::detail {

/// Rotor angle from the vibration of one channel at steady speed: 1X is the largest line that is no electric one, or
/// half of its frequency where a line of more than half of its size stands there. `halved`: a line stands there, larger
/// or smaller. The phase of 1X is followed in blocks of 16 turns. Nothing where there is no such line or its phase
/// cannot be followed.
std::optional<Rotation> vibration_angle(const Eigen::VectorXd& samples, double dt, const std::vector<double>& mains,
                                        bool& halved);

}  // namespace whirl::diagnosis::detail
