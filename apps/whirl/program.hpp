#pragma once

namespace whirl::app {

/// The whole program but its choice of a faster build: tests call it in a process of their own. What was printed counts
/// as written only when all of it has arrived. Returns the exit code.
int program(int argc, char** argv);

}  // namespace whirl::app
