#pragma once
// All of whirl: the verbs and values of its four ideas (record, model, controller, rig) in `whirl::`, everything else
// in the namespace of its library. See docs/architecture.md and examples/cpp.
//
//   auto id = whirl::identify(whirl::io::read("rundown.csv"));
//   if (!id.usable()) return fail(id.summary);
//   auto controller = whirl::design(id.model, {.mass_kg = 1.5});
//   auto run = whirl::run(controller, whirl::VirtualRig{});
//   whirl::io::save("controller.json", controller);

#include "whirl/control/controller.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/stiffness_law.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl {

using identification::Identification;
using identification::identify;
using identification::IdentifyOptions;
using identification::validate;
using identification::Validation;
using tuning::ClosedLoopRun;

/// The test rig that a controller runs on in simulation, by default that of the paper with its 1.5 kg disk.
struct VirtualRig {
  rig::RigParameters parameters;
  tuning::ClosedLoopOptions options;  ///< seed of the sensor noise, faults, safety limits
};

/// What a design needs beside the model.
struct DesignRequest {
  double mass_kg = 0;  ///< turns forces into accelerations; 0: the input gain of the model
  std::string law = "tsmc";
  std::string estimator = "kfe";
  /// Data sheets of sensors, converters and actuators and the speed profile; by default those of the virtual rig.
  tuning::Hardware hardware = tuning::data_sheet(rig::RigParameters{});
  int evaluations = 160;  ///< of the objective
  std::uint64_t seed = 1;
};

/// A tuned controller for an identified rotor. Throws Error for a mass below 0 or not finite, and as tuning::design
/// does.
inline ControllerDesign design(const IdentifiedModel& model, const DesignRequest& request = {}) {
  if (!(request.mass_kg >= 0 && request.mass_kg < 1e9))
    throw Error("mass_kg is " + std::to_string(request.mass_kg) +
                ": it must be positive, or 0 for the gain of the model");
  tuning::DesignOptions options;
  options.law = request.law;
  options.estimator = request.estimator;
  options.hardware = request.hardware;
  options.gain = request.mass_kg > 0 ? 1 / request.mass_kg : 0;
  options.evaluations = request.evaluations;
  options.seed = request.seed;
  return tuning::design(model, options);
}

/// One run of the whole speed profile under control: log and metrics.
inline ClosedLoopRun run(const ControllerDesign& controller, const VirtualRig& rig) {
  return tuning::run_closed_loop(controller, rig.parameters, rig.options);
}

namespace io {

/// A recording from any file that whirl reads (docs/formats.md). Throws Error naming file and line.
inline Recording read(const std::filesystem::path& path) { return read_recording(path); }

}  // namespace io
}  // namespace whirl
