#pragma once
#include <vector>

#include "command.hpp"
#include "identify_options.hpp"

namespace whirl::app {

/// `whirl identify --compare`: every regression method on one record, its library and its held-out part, and the
/// methods of whirl that need no choice of regressor.
void compare_methods(const IdentifyOptions& options, const std::vector<Recording>& records, Session& session);

}  // namespace whirl::app
