#pragma once
#include "command.hpp"
#include "identify_evidence.hpp"
#include "identify_options.hpp"

namespace whirl::app {

/// `whirl identify --stream`: --method sindy on one file of any length, read twice: --holdout is a share of its
/// samples.
IdentifiedModel identify_stream(const IdentifyOptions& options, Session& session, Evidence& evidence);

}  // namespace whirl::app
