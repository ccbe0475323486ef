#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl response`.
void add_response(CommandLine& app, Session& session);
/// `whirl simulate`.
void add_simulate(CommandLine& app, Session& session);
/// `whirl runup`.
void add_runup(CommandLine& app, Session& session);

}  // namespace whirl::app
