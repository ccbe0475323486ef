#pragma once
#include "whirl/pages/record_views.hpp"

namespace whirl::pages {

/// Path of the disk centre with the ellipse of its 1X vectors, the same vectors as those of the Bode plot: their mean
/// where they agree within a tenth, else those of the turn with the largest radius.
report::Figure orbit(const std::vector<ViewedRun>& runs, const ViewOptions& options);

/// Mean position over each turn, from the first one on, with the speeds written along it (shaft centreline).
report::Figure centreline(const std::vector<ViewedRun>& runs, const ViewOptions& options);

}  // namespace whirl::pages
