#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "whirl/diagnosis/rotation.hpp"
#include "whirl/pages/record_views.hpp"

namespace whirl::pages {

std::string_view window_name(signal::Window window);

/// rotation_of; nothing where the angle of the record cannot be read.
std::optional<diagnosis::Rotation> readable_rotation(const Recording& record);

/// rotation_of; throws Error saying what is missing when there is none.
diagnosis::Rotation required_rotation(const Recording& record);

/// "waterfall", "full-waterfall", "cascade" or "run-map" of one channel (x and y where full).
report::Figure map_view(const std::string& what, const Recording& record, const std::string& channel,
                        const ViewOptions& options);

}  // namespace whirl::pages
