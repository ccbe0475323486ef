#pragma once
#include "whirl/pages/record_views.hpp"

namespace whirl::pages {

/// The channel a figure of one channel takes: the first of the options, x without any.
const std::string& channel_of(const ViewOptions& options);

std::vector<report::NamedRun> named(const std::vector<ViewedRun>& runs);

/// Samples between the begin and the end of the options. Throws Error when they are fewer than 16.
Recording cut(const Recording& record, const ViewOptions& options);

}  // namespace whirl::pages
