#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl rig serve`.
void add_rig_serve(CLI::App& rig, Session& session);

}  // namespace whirl::app
