#pragma once
#include <string>
#include <string_view>

#include "whirl/shaft/control/controller.hpp"

namespace whirl::shaft {

/// The controller as C99: `name.h` and `name.c` with `name_start(state*)` and `name_step(state*, readings, angle,
/// speed, forces)`, the step of RotorControl. It allocates nothing and needs math.h alone.
struct ControllerCode {
  std::string header, source;
};
/// Throws Error for a name that is none in C.
ControllerCode controller_code(const RotorController& controller, std::string_view name);

}  // namespace whirl::shaft
