#pragma once
#include "whirl/io/json.hpp"
#include "whirl/shaft/centrifuge/load_check.hpp"
#include "whirl/shaft/centrifuge/speed_limits.hpp"

namespace whirl::shaft {

/// Documents of docs/formats.md: whirl.centrifuge_check/1 and whirl.centrifuge_limits/1.
io::Json load_check_json(const LoadCheck& check);
io::Json speed_limits_json(const SpeedLimits& limits);

}  // namespace whirl::shaft
