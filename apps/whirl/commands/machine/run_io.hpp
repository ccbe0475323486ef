#pragma once
#include <string>

#include "command.hpp"
#include "live_view.hpp"

namespace whirl::app {

/// Options of `whirl run` that belong to the loop on hardware.
struct RunIoOptions {
  std::string io, record;
  double seconds = 0;
  bool require_rt = false;

  void add_to(CommandLine* sub);
};
/// `whirl record`: the loop disarmed, recorded. `whirl replay`: a recording through a controller.
void add_record(CommandLine& app, Session& session);
void add_replay(CommandLine& app, Session& session);

/// The loop on the wall clock with the hardware of `options.io`; with `view`, shown and commanded by the page.
void run_io(Session& session, const std::string& controller, const RunIoOptions& options,
            const ViewOptions* view = nullptr);

}  // namespace whirl::app
