#pragma once
#include <string_view>

namespace whirl::io {

/// The unit in which a quantity of this name is mostly recorded, for an example: mm, rad for an angle, ...
std::string_view usual_unit(std::string_view name);

}  // namespace whirl::io
