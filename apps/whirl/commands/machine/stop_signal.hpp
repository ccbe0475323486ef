#pragma once

namespace whirl::app {

/// From now on SIGINT, SIGTERM and SIGHUP ask for the end instead of ending the program; the second one ends it at
/// once. A SIGHUP that is ignored, as after nohup, stays so.
void catch_stop_signals();
/// The signal that came; 0: none.
int stop_signal() noexcept;
inline bool stop_requested() noexcept { return stop_signal() != 0; }

}  // namespace whirl::app
