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
#include "whirl/io/formats.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/verbs.hpp"

namespace whirl {

using identification::Identification;
using identification::identify;
using identification::IdentifyOptions;
using identification::validate;
using identification::Validation;

}  // namespace whirl
