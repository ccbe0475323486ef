#pragma once
#include <string>

#include "whirl/pages/record_views.hpp"

namespace whirl::pages {

/// One line about a run for the foot of a figure: the file, the part shown, what the shaft did in it and how fast.
std::string run_line(const ViewedRun& run, const ViewOptions& options);

}  // namespace whirl::pages
