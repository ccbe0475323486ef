#pragma once
#include "whirl/core/control_types.hpp"

namespace whirl::rt {

// Faults that only a loop knows, beside those of the controller; whirl::to_string names them too.
inline constexpr Fault kGap{7};              ///< too many ticks left out at once
inline constexpr Fault kImplausible{8};      ///< tick, angle or speed of the board cannot be
inline constexpr Fault kBoardRestarted{10};  ///< the board's session number changed while armed
inline constexpr Fault kEncoderStuck{11};    ///< the angle stands while the rotor turns
inline constexpr Fault kBoardLost{12};       ///< the board's driver reports an error: it is gone for good

}  // namespace whirl::rt
