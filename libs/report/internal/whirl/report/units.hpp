#pragma once
#include "whirl/core/angles.hpp"
#include "whirl/report/figure.hpp"

namespace whirl::report {

/// Units of the axes that are no amplitude; those of an amplitude come from its quantity (`AmplitudeScale::unit_for`).
inline const Unit kSecond{"s", 1};
inline const Unit kHertz{"Hz", 1};
inline const Unit kHertzOfAngular{"Hz", kTwoPi};  ///< of a frequency held in rad/s
inline const Unit kRpm{"rpm", kRadPerSecPerRpm};
inline const Unit kRpmPerSecond{"rpm/s", kRadPerSecPerRpm};
inline const Unit kDegree{"°", kRadPerDegree};
inline const Unit kPercent{"%", 1};
inline const Unit kPercentOfOne{"%", 0.01};  ///< of a ratio
inline const Unit kDecibel{"dB", 1};

/// Shows y of the panel in the engineering unit of the quantity for the largest value of its series.
void show_y_as(Panel& panel, Quantity quantity);

}  // namespace whirl::report
