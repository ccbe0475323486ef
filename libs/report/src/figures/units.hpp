#pragma once
#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"

namespace whirl::report {

inline const Unit kHertz{"Hz", 1};
inline const Unit kRpm{"rpm", kRadPerSecPerRpm};
inline const Unit kDegree{"°", kRadPerDegree};

}  // namespace whirl::report
