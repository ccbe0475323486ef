#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl rig campbell`.
void add_rig_campbell(CommandLine& rig, Session& session);

}  // namespace whirl::app
