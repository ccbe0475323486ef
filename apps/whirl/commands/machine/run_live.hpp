#pragma once
#include <cstdint>

#include "command.hpp"
#include "live_view.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::app {

struct RunLiveOptions {
  ViewOptions view;
  std::uint64_t seed = 1;
  bool repeat = false;
};

/// The closed loop on the virtual rig in real time, shown and commanded by the page, until a stop signal. The time of
/// the rig is counted in ticks: a late machine makes the rig late, never wrong.
void run_live(Session& session, const ControllerDesign& design, const rig::RigParameters& rig,
              const RunLiveOptions& options);

}  // namespace whirl::app
