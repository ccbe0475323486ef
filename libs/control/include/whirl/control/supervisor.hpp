#pragma once
#include <complex>
#include <cstdint>
#include <optional>
#include <string>

#include "whirl/control/force_check.hpp"
#include "whirl/control/lateral_model.hpp"
#include "whirl/core/control_types.hpp"

namespace whirl::control {

/// Fault of a loop whose supervision has taken every other step; whirl::to_string names it.
inline constexpr Fault kSupervision{9};

/// Bits of the status word. Steps first, reasons from bit 8 on.
enum SupervisionBit : std::uint32_t {
  kAdaptationFrozen = 1,     ///< the 1x adaptation of the law stands still
  kFeedforwardReplaced = 2,  ///< the force follows the unbalance that is estimated here, not the one designed with
  kGainLowered = 4,          ///< the feedback acts with half or a quarter of its gain
  kFeedbackOff = 8,          ///< the law does not act: feedforward and a weak damping of the supervisor's own do
  kForceOff = 16,            ///< no force
  kSupervisionTrip = 32,     ///< the step answers kSupervision
  kGrowth = 256,             ///< motion that does not turn with the rotor is large and does not decay
  kFeedforwardPhase = 512,   ///< the feedforward is more than 60 degrees off the unbalance that acts
  kUnbalanceChanged = 1024,  ///< its size or angle is off by more than a third
  kSaturation = 2048,        ///< the force was at its limit more than half of the time
  kSensorLost = 4096,        ///< readings are missing
  kWorseThanOpen = 8192,     ///< the synchronous motion is larger than it would be without control
  kForceLost = 16384,        ///< the rotor does not follow the force of an axis
  kForceReversed = 32768,    ///< it moves against the force of an axis
  kForceLate = 65536,        ///< the force acts some 5 to 19 ms later than designed for
  kForceTested = 131072,     ///< it was let go for 6 to 24 ms, to tell a wrong force from another unbalance
};

/// Reasons that say that a design does not hold its rotor.
inline constexpr std::uint32_t kUnheld = kGrowth | kWorseThanOpen | kForceLost | kForceReversed | kForceLate;

/// "gain lowered (growth of motion beside the synchronous one)"; empty for 0.
std::string supervision_text(std::uint32_t word);

struct SupervisorSettings {
  LateralModel model;
  std::complex<double> eps;  ///< designed with, m
  double sample_time = 1e-3;
  double level = 100e-6;   ///< rms of the non-synchronous motion that is too much, m
  double bandwidth = 100;  ///< poles of the observer of the unbalance, 1/s
  bool fixed = true;       ///< the feedforward is from `eps`, which is compared with the unbalance that acts
  bool carried = false;    ///< the law has no force of the speed of its own: its feedback carries the unbalance
  double delay = 0;        ///< of the loop, s
  double limit = 0, slew = 0, hysteresis = 0;  ///< of the force, as accelerations: ForceCheckSettings
};

/// What the supervisor sees of one sample, at the time the displacement was taken.
struct SupervisorInput {
  std::complex<double> z;  ///< displacement, m
  bool fresh = true;
  bool saturated = false;                    ///< the last force was at its limit
  std::complex<double> a;                    ///< control acceleration over the last interval, m/s^2
  std::complex<double> forcing;              ///< unbalance_per_metre
  std::complex<double> turn;                 ///< e^{i beta}
  std::complex<double> d;                    ///< unbalance acceleration that the law is given, m/s^2
  double omega = 0;                          ///< rad/s
  std::optional<std::complex<double>> half;  ///< e^{i omega h / 2} where the caller has it
  long held = 0;                             ///< samples lost in a row
  bool gap = false;                          ///< ticks were left out since the sample before
};

/// What it decides. The acceleration sent is (1 - own) (-d + gain (a + d)) + own (damper - d), a what the law asks for
/// and d the disturbance, times `force`.
struct Supervision {
  std::uint32_t word = 0;
  double gain = 1;              ///< of the feedback, 0 to 1
  double force = 1;             ///< of the whole force, 0 to 1
  double own = 0;               ///< 0: the law acts; 1: the supervisor's own feedforward and damping in its place
  std::complex<double> damper;  ///< m/s^2, against the velocity of the supervisor's observer; 0 while own is
  double blend = 0;             ///< 0: the law's own disturbance; 1: `eps` of the supervisor
  std::complex<double> eps;     ///< eccentricity that acts, as estimated, m
  double level = 0;             ///< rms of the non-synchronous motion, m
  bool adapt = true;            ///< the law may adapt at 1x
  bool trip = false;
};

/// Watches a running loop and takes it back in steps: fixed size, pure, no allocation, no exception; a copy is an
/// independent supervisor in the same state.
///
/// - An observer of the model with a disturbance that turns with the rotor finds the unbalance that acts (poles -p, -p
///   and, turning, -p). Where a feedforward from a fixed eccentricity differs from it by more than a third for 30 ms,
///   it follows the estimate from then on, from zero when it was worse than none: with a lost or turned mass, a wrong
///   gain or a slipped encoder the estimate is what cancels.
/// - A notch takes the synchronous part out of the readings. When the rest is above `level` for 60 ms and does not
///   decay, the next step is taken, 60 ms later again, two at once above three times the level: adaptation and
///   estimated feedforward frozen at their last quiet value; half the gain; a quarter; the law off; no force
///   (faded over 0.3 s, because a sudden end would excite the rotor); trip. In the place of a law that is off stand the
///   feedforward of the last quiet estimate, which follows again while the motion is quiet, and a weak damping (0.15
///   of critical) of the observer's velocity, which hardly contains what is far above the rotor's own frequency: a
///   rotor let go from its held state would ring for seconds. A fixed feedforward begins with a quarter of the gain; a
///   law whose feedback alone carries the unbalance gets the feedforward first and is then taken off at once, because
///   less gain would let the rotor go. Motion at twice the level while the force is at its limit more than half of the
///   time takes the law off at once. Once the law is off, only what grows goes further down. A synchronous motion 1.1
///   times as large as the model's without control, and a quarter of `level` more, takes the same steps.
/// - Where the law follows the unbalance itself, an unbalance that changes by more than a third within 0.3 s is given
///   0.4 s: its transient is no growth, and what the law adapts to is right.
/// - A feedback with half or a quarter of its gain leaves more of what the feedforward misses: while the motion is
///   quiet, the feedforward from a fixed eccentricity follows the estimate then, too. Quiet for a second, the law gets
///   its gain back, once in a run.
/// - Where an actuator is lost or reversed (ForceCheck) there is nothing left to lower: it trips at once. Where
///   another unbalance would look the same, the force is let go for 6 to 24 ms first; when it is the unbalance, the
///   feedforward follows it and the law goes on.
/// - A force that is late still acts. Ended at once it would leave the rotor ringing, and the ringing adds to the
/// motion
///   at the next critical speed: the law goes off at once, the feedforward is turned ahead by the delay that was found,
///   and the force fades within a second, then it trips.
/// - Without readings the feedback fades within 10 ms; it returns with them.
/// Other steps stay until `reset`, but for those of a lost sensor and of saturation.
class Supervisor {
 public:
  Supervisor() = default;
  explicit Supervisor(const SupervisorSettings& settings) noexcept;

  Supervision step(const SupervisorInput& in) noexcept;
  void reset() noexcept;

 private:
  void observe(const SupervisorInput& in) noexcept;
  void judge_feedforward(const SupervisorInput& in) noexcept;
  void judge_motion(const SupervisorInput& in) noexcept;
  void judge_force(const SupervisorInput& in) noexcept;
  void step_down(std::uint32_t reason) noexcept;
  void let_go_late() noexcept;

  SupervisorSettings settings_;
  ForceCheck check_;
  bool started_ = false;
  DiskMotion motion_;
  std::complex<double> synchronous_, offset_, eps_, quiet_, used_;
  double square_ = 0, mark_ = 0, time_ = 0, above_ = 0, wait_ = 0, mismatch_ = 0, worse_ = 0, saturated_ = 0,
         sudden_ = 0;             // s
  double calm_ = 0, settle_ = 0;  // s: quiet with less gain; left to the transient of another unbalance
  double gain_ = 1, force_ = 1, blend_ = 0, own_ = 0, sensor_ = 1, held_ = 1;  // as they act
  double late_ = 0;  // by which the force was found late, s; 0: it is not
  int steps_ = 0;    // taken back: 1 adaptation; 2, 3 gain; 4 feedback; 5 force; 6 trip
  bool follow_ = false, returned_ = false;
  std::uint32_t reasons_ = 0;
};

}  // namespace whirl::control
