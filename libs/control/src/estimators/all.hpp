#pragma once
#include <array>

#include "whirl/control/method.hpp"

namespace whirl::control {

// The estimators of the catalogue in the order in which they are listed; one line and one name for a new one.
EstimatorEntry difference_estimator();
EstimatorEntry lpf_estimator();
EstimatorEntry red_estimator();
EstimatorEntry red_implicit_estimator();
EstimatorEntry eso_estimator();
EstimatorEntry kalman_estimator();
EstimatorEntry kfe_estimator();
EstimatorEntry kfo_estimator();

inline constexpr std::array kEstimators{difference_estimator, lpf_estimator,    red_estimator, red_implicit_estimator,
                                        eso_estimator,        kalman_estimator, kfe_estimator, kfo_estimator};

}  // namespace whirl::control
