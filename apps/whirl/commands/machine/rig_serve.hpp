#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl rig serve`.
void add_rig_serve(CommandLine& rig, Session& session);

}  // namespace whirl::app
