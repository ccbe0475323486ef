#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl balance`.
void add_balance(CommandLine& app, Session& session);

}  // namespace whirl::app
