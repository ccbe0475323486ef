#pragma once
#include <string>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::modal {

/// Kind of frequency response that a channel gives. Throws Error unless it is a motion.
FrfKind kind_of(const Channel& channel);

/// The channel of this name; throws Error when it is absent or a motion.
const Channel& force_named(const Recording& record, const std::string& name);

/// Channels of `result` and their kind: every motion of the record to each of `forces`, which are called `references`.
/// Throws Error where there is no motion, or where the motions are of several kinds.
void name_channels(const Recording& record, const std::vector<std::string>& forces,
                   const std::vector<std::string>& references, FrequencyResponse& result);

}  // namespace whirl::modal
