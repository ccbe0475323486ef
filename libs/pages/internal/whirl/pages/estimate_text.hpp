#pragma once
#include <string>
#include <string_view>

#include "whirl/core/estimate.hpp"

namespace whirl::pages {

/// "5667.3 ± 0.4 1/s²   95 % [5666.5, 5668.1]": value, standard deviation, unit, interval where it is known.
std::string estimate_text(const Estimate& estimate, std::string_view unit);

}  // namespace whirl::pages
