#pragma once
#include "whirl/io/json.hpp"
#include "whirl/shaft/control/controller.hpp"
#include "whirl/shaft/control/design.hpp"
#include "whirl/shaft/control/passages.hpp"

namespace whirl::shaft {

/// Documents of docs/formats.md.
io::Json controller_json(const RotorController& controller);
RotorController read_controller(const io::JsonReader& in);
io::Json control_design_json(const ControlDesign& design);
io::Json passages_json(const std::vector<ControlledPassage>& passages);

}  // namespace whirl::shaft
