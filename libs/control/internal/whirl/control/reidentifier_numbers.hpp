#pragma once

namespace whirl::control {

/// Numbers of the re-identification, written once like those of the supervision: the exported C gets them as literals.
/// How often they err is counted in libs/control/test/reidentifier_property_test.cpp.
#define WHIRL_REIDENTIFIER_NUMBERS(X)                                                                  \
  X(keep, 0.97)       /* of the information of a window in the next: about 100 turns are remembered */ \
  X(error, 3e-3)      /* of a window's equation, relative to elastic and control acceleration, */      \
  X(floor, 1e-6)      /* and as a deflection, m */                                                     \
  X(prior, 0.5)       /* sd of stiffness, damping, gain before anything was seen, of their bounds */   \
  X(eccentric, 50e-6) /* the same of the eccentricity beside its own size, m, */                       \
  X(runout, 10e-6)    /* of a runout at 1x, m, */                                                      \
  X(across, 0.05)     /* and of the share of the force that acts across it: delay, coupling of axes */ \
  X(known, 0.25)      /* sd below this share of the bound: determined */                               \
  X(differs, 2.5)     /* sd by which a number differs before the force is corrected for it, */         \
  X(remains, 1)       /* and by which it goes on to */                                                 \
  X(memory, 0.1)      /* of the residual's mean square, per window */                                  \
  X(unlike, 9)        /* mean square of the residual that the equation's error does not explain */     \
  X(beyond, 1.5)      /* of a bound, and 2 sd more: another machine than the design's */               \
  X(rate, 0.016)      /* of a bound per turn: how fast the correction moves */                         \
  X(slow, 0.3)        /* of the natural frequency: speed below which nothing is learned */             \
  X(fast, 0.7)        /* rad per sample above which nothing is learned */

namespace reidentification {
#define WHIRL_NUMBER(name, value) inline constexpr double name = value;
WHIRL_REIDENTIFIER_NUMBERS(WHIRL_NUMBER)
#undef WHIRL_NUMBER
}  // namespace reidentification

}  // namespace whirl::control
