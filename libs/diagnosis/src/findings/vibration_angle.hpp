#pragma once
#include <optional>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/rotation.hpp"

namespace whirl::diagnosis::detail {

/// Rotor angle from the vibration of one channel at steady speed: 1X is the largest line that is no electric one, or
/// half of its frequency where a line of 0.3 of its size or more stands there. Its phase is followed in blocks of 16
/// turns. Nothing where there is no such line or its phase cannot be followed.
std::optional<Rotation> vibration_angle(const Eigen::VectorXd& samples, double dt, const std::vector<double>& mains);

}  // namespace whirl::diagnosis::detail
