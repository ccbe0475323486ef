#pragma once
#include <string>
#include <string_view>

#include "whirl/core/estimate.hpp"

namespace whirl::app {

/// "5667.3 ± 0.4 1/s²  [5666.5, 5668.1]": value, standard deviation, unit, 95 % interval.
std::string show(const Estimate& estimate, std::string_view unit);

}  // namespace whirl::app
