#pragma once
#include "command.hpp"

namespace whirl::app {

/// `whirl balance`.
void add_balance(CLI::App& app, Session& session);

}  // namespace whirl::app
