#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl decay` and `whirl sine`.
void add_nonlinear_mode(CommandLine& app, Session& session);

}  // namespace whirl::app
