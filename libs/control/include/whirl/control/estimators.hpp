#pragma once
#include <variant>

#include "whirl/control/estimators/difference.hpp"
#include "whirl/control/estimators/eso.hpp"
#include "whirl/control/estimators/kalman.hpp"
#include "whirl/control/estimators/red.hpp"

namespace whirl::control {

/// The estimators a controller can hold; one line for a new one. What each is made of: src/estimators.
using AnyEstimator = std::variant<FilteredDifference, LevantDifferentiator, ExtendedStateObserver, KalmanEstimator>;

}  // namespace whirl::control
