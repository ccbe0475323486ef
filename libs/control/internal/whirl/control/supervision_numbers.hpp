#pragma once

namespace whirl::control {

/// Numbers of force check and supervisor, written once: the library reads them by name, the exported C gets them as
/// literals (slot `n_NAME`). Times in s, rates in 1/s, the rest are shares.
///
/// How often the limits of the force check err is counted on machines drawn at random
/// (libs/tuning/test/limited_machines_test.cpp); the seeds they were chosen on are not those that are counted.
#define WHIRL_FORCE_CHECK_NUMBERS(X)                                                                      \
  X(pole, 600)     /* low-pass of all signals, three of them */                                           \
  X(window, 8e-3)  /* of the weighted means */                                                            \
  X(late, 8e-3)    /* delay of the force that is looked for */                                            \
  X(later, 12e-3)  /* the same, for one that the first probe explains badly */                            \
  X(block, 1e-3)   /* of the memory of the late force */                                                  \
  X(share, 0.7)    /* of `level`: static deflection of a force that is judged */                          \
  X(slow, 0.02)    /* of k1: unbalance acceleration per metre below which the rotor stands */             \
  X(edge, 20e-3)   /* after the first force: when it begins to act is known to some ms only */            \
  X(start, 0.15)   /* in which the unbalance is not known yet */                                          \
  X(settled, 0.02) /* time constants of the unbalance that is followed: while starting, */                \
  X(learn, 0.1)    /* while nothing else is to be explained, */                                           \
  X(relearn, 0.03) /* while a residual stands */                                                          \
  X(stuck, 0.15)   /* after which a residual stands */                                                    \
  X(usual, 0.3)    /* memory of the residual */                                                           \
  X(risen, 4)      /* r^2 over that of the memory: has just risen */                                      \
  X(left, 0.2)     /* of r^2 that a suspicion may leave unexplained */                                    \
  X(other, 0.25)   /* of r^2 that another unbalance leaves, below which it is thought of */               \
  X(better, 0.7)   /* by which a suspicion has to be better than another unbalance */                     \
  X(low, 0.35)     /* gain of an actuator that is lost, at most */                                        \
  X(high, 1.4)     /* gains outside these are no fault that is known */                                   \
  X(least, -1.6)                                                                                          \
  X(reverse, -0.4)   /* gain of an actuator of the wrong sign, at most */                                 \
  X(late_least, 0.6) /* share of the delay that is found, at least and at most */                         \
  X(late_most, 1.6)                                                                                       \
  X(test, 24e-3)       /* in which the force is let go, at most */                                        \
  X(known_test, 16e-3) /* the same where the force was not limited before, and the window then */         \
  X(known_window, 3e-3)                                                                                   \
  X(told_by, 0.3)    /* one explanation over the other */                                                 \
  X(remains, 0.3)    /* of r^2 without force, where it was the force */                                   \
  X(clear, 0.25)     /* of what another unbalance leaves: no test is needed */                            \
  X(told, 6e-3)      /* at least */                                                                       \
  X(again, 0.5)      /* between two tests */                                                              \
  X(unlike, 0.5)     /* of r^2 that another unbalance leaves: an early test may tell more */              \
  X(proof_time, 1)   /* in which the force acted: it is proven */                                         \
  X(idle, 0.25)      /* gain of actuators that seem dead from the first tick on */                        \
  X(early_left, 0.3) /* the same as `left` and `low`, for an early test */                                \
  X(early_low, 0.1)                                                                                       \
  X(confirm, 8e-3)  /* a suspicion or a proof lasts so long: usually, */                                  \
  X(quick, 2e-3)    /* large and of the wrong sign, */                                                    \
  X(unclear, 10e-3) /* where another unbalance would explain it, */                                       \
  X(early, 10e-3)   /* while starting */                                                                  \
  X(large, 2)       /* times the threshold */                                                             \
  X(plain, 0.06)    /* of r^2 that an explanation leaves which no limit of a force imitates */            \
  X(alone, 0.1)     /* of r^2 that a delay leaves where the stiffness is taken as it is */                \
  X(sound, 0.7)     /* gain of a sound actuator, at least: 30 % less, the tolerance of the certificate */ \
  X(proof, 2)       /* by how much that gain has to fit worse, in what the best gains leave of r^2 */     \
  X(blind_proof, 6) /* the same where the force was limited and its slew is not stated */                 \
  X(model, 0.25)    /* of k1: stiffness that the model may have wrong in either direction */              \
  X(play, 0.03)     /* of the force limit: hysteresis of an actuator whose data sheet states none */      \
  X(full, 5e-3)     /* in which an actuator whose data sheet states no slew reaches its limit */          \
  X(unsure, 15e-3)  /* after saturation or slewing in which nothing is judged, beside the loop delay */

/// Of the supervisor.
#define WHIRL_SUPERVISOR_NUMBERS(X) X(late_fade, 1) /* in which a force that is late ends */

#define WHIRL_NUMBER(name, value) inline constexpr double name = value;
namespace force_check {
WHIRL_FORCE_CHECK_NUMBERS(WHIRL_NUMBER)
}
namespace supervision {
WHIRL_SUPERVISOR_NUMBERS(WHIRL_NUMBER)
}
#undef WHIRL_NUMBER

}  // namespace whirl::control
