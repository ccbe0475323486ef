#pragma once
#include "whirl/core/control_types.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {

/// What one step of an exported controller costs on a processor.
struct StepCost {
  long mean = 0, worst = 0;  ///< instructions of a step, counted over 4000 steps through resonance
  long stack = 0;            ///< deepest, bytes
  long state = 0;            ///< struct of the controller, bytes
  long flash = 0;            ///< bytes of code and constants, with the mathematical functions it needs
};

/// Compiles the exported controller in single precision for a Cortex-M4F with `arm-none-eabi-gcc` (-O2), runs it in
/// `qemu-system-arm` (machine mps2-an386, 1 ns of its time an instruction, resolution 40) and counts. The run has lost
/// readings, and a motion that does not depend on the force: supervision runs, but is given no reason to step in.
/// Throws Error where one of the tools or newlib is not installed, with the Debian package's name; where the
/// controller does not run to its end; for what float cannot hold.
StepCost cortex_m4f_cost(const ControllerDesign& design);

}  // namespace whirl::deploy
