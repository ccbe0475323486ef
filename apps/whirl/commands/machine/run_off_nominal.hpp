#pragma once
#include <cstdint>

#include "whirl/core/control_types.hpp"
#include "whirl/rig/parameters.hpp"

namespace whirl::app {
struct Session;

/// The controller on 18 machines it was not made for, without and with supervision. `summary`: what the rig that they
/// are made from is already known to lack.
void run_off_nominal(Session& session, const ControllerDesign& design, const rig::RigParameters& rig,
                     std::uint64_t seed, Summary summary);

}  // namespace whirl::app
