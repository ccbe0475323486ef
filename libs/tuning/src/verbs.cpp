#include "whirl/tuning/verbs.hpp"

#include <fmt/format.h>

#include "whirl/core/error.hpp"

namespace whirl {

ControllerDesign design(const IdentifiedModel& model, const DesignRequest& request) {
  if (!(request.mass_kg >= 0 && request.mass_kg < 1e9))
    throw Error(fmt::format("mass_kg is {}: it must be positive, or 0 for the gain of the model", request.mass_kg));
  tuning::DesignOptions options;
  options.law = request.law;
  options.estimator = request.estimator;
  options.hardware = request.hardware;
  options.gain = request.mass_kg > 0 ? 1 / request.mass_kg : 0;
  options.evaluations = request.evaluations;
  options.seed = request.seed;
  return tuning::design(model, options);
}

ClosedLoopRun run(const ControllerDesign& controller, const VirtualRig& rig) {
  return tuning::run_closed_loop(controller, rig.parameters, rig.options);
}

}  // namespace whirl
