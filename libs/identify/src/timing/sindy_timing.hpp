#pragma once
#include <vector>

#include "whirl/identify/sindy.hpp"

namespace whirl::identification::detail {

/// fit_sindy with every input band-limited and without dead time.
IdentifiedModel fit_untimed(const std::vector<Recording>& records, const SindyOptions& options,
                            std::vector<BoundOutcome>* bounds);

/// Is there an input whose hold or dead time is given or to be found?
bool timing_sought(const SindyOptions& options);
/// fit_sindy with holds and dead times.
IdentifiedModel fit_timed(const std::vector<Recording>& records, const SindyOptions& options,
                          std::vector<BoundOutcome>* bounds);

}  // namespace whirl::identification::detail
