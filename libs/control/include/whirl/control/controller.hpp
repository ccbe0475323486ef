#pragma once
#include <array>
#include <complex>

#include "whirl/control/estimators.hpp"
#include "whirl/control/gate.hpp"
#include "whirl/control/laws.hpp"
#include "whirl/control/reidentifier.hpp"
#include "whirl/control/runout.hpp"
#include "whirl/control/structure.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"

namespace whirl::control {

/// What happened inside the last step, for logging. SI; complex = x + i y.
struct ControllerState {
  std::complex<double> measured;   ///< after gate, runout, offset and structural modes, m
  DiskMotion estimate;             ///< at the time the sample was taken
  DiskMotion effect;               ///< what the law used: at the time of effect when predicting or advancing
  std::complex<double> s;          ///< sliding variables s_x + i s_y, m/s
  std::complex<double> requested;  ///< force before the limit, N
  std::complex<double> applied;    ///< force after the limit, N
  bool saturated = false;          ///< the force is at its limit or changes as fast as it may
  bool held = false;               ///< the sample was lost and the last good one held
  long held_total = 0;
  Supervision supervision;            ///< of this step; neutral without supervision
  Reidentification reidentification;  ///< after this step; nothing without it
};

struct LoopTiming {
  double step = 0;    ///< h, s
  double delay = 0;   ///< sensor + computation + lag, s
  double sensor = 0;  ///< the sensor's share of it, s
};

/// What the actuators can do; 0: no limit, or not known.
struct ForceLimits {
  double largest = 0;     ///< N
  double slew = 0;        ///< N/s
  double hysteresis = 0;  ///< width, N
};

/// Re-identification beside the supervision. While it acts, law, estimator and supervisor see the design's machine: the
/// force sent is (a + dk z + dc v) / g, a what they asked for, and a is what they are told was sent.
enum class Reidentify { off, says, acts };

struct Feedforward {
  bool on = true;        ///< the disturbance estimate (or the model's unbalance) is part of f
  bool advance = true;   ///< disturbance at the time of effect
  bool carried = false;  ///< nothing but the feedback carries the unbalance
};

/// Settings around estimator and law, all numbers checked.
struct ControllerSettings {
  LateralModel model;
  std::complex<double> eps, offset;
  double gain = 0;  ///< b, acceleration per newton
  LoopTiming timing;
  ForceLimits force;
  double cancel = 1;  ///< fraction of the linear stiffness that model-based laws cancel
  Feedforward feedforward;
  bool predict = false;    ///< position and velocity at the time of effect
  long stale_limit = 100;  ///< held samples in a row after which the step faults
  bool supervise = false;  ///< the supervisor beside the law acts
  Reidentify reidentify = Reidentify::off;
};

/// Estimator, prediction over the loop delay, law, feedforward and force limit as one fixed-size value.
/// Copyable: a copy is an independent controller in the same state. The step is pure (state and measurement
/// in, state and command out), never throws, never allocates.
class Controller {
 public:
  /// Longest loop delay in samples that the force history holds.
  static constexpr int kMaxDelay = 16;

  Controller(const ControllerSettings& settings, const AnyEstimator& estimator, const AnyLaw& law,
             const SampleGate& gate, const Runout& runout, const Supervisor& supervisor = {},
             const std::array<StructureMode, Structure::kModes>& modes = {},
             const Reidentifier& reidentifier = {}) noexcept;

  /// Faults: not_finite (angle, speed or result), stale_sensor (more than stale_limit lost samples in a row),
  /// kSupervision (its last step).
  /// A fault leaves the command at zero in the history; whether it latches is the loop's business.
  Expected<Command, Fault> step(const Measurement& m) noexcept;

  /// The force that was really sent when the loop limited the command further (slew, trip): corrects the
  /// history.
  void applied(const Command& command) noexcept;

  void reset() noexcept;
  const ControllerState& state() const noexcept { return state_; }
  const AnyLaw& law() const noexcept { return law_; }
  const ControllerSettings& settings() const noexcept { return settings_; }

 private:
  std::complex<double> past(int samples) const noexcept;  ///< control acceleration sent `samples` ticks ago (>= 1)
  DiskMotion at_effect(const DiskMotion& now, double omega, const SampleTurns& turns) const noexcept;
  std::complex<double> sent(int samples) const noexcept;  ///< the same of the force, which past() is seen as
  void push(std::complex<double> sent) noexcept;
  std::complex<double> seen(std::complex<double> sent) const noexcept;
  std::complex<double> corrected(std::complex<double> asked) noexcept;
  void reidentify(const EstimatorInput& in, std::complex<double> turn, double omega_dot) noexcept;
  void limit_force() noexcept;
  void watch(const EstimatorInput& in, std::complex<double> turn) noexcept;

  ControllerSettings settings_;
  AnyEstimator estimator_;
  AnyLaw law_;
  SampleGate gate_;
  Runout runout_;
  Supervisor supervisor_;
  Reidentifier reidentifier_;
  Structure structure_;
  bool has_runout_;
  int whole_delay_;  ///< delay = (whole_delay_ + fraction_) h
  double fraction_;
  double time_ = 0;   ///< of the last sample, s
  bool gap_ = false;  ///< ticks were left out before this one
  std::array<std::complex<double>, kMaxDelay + 3> history_{}, sent_{};
  std::complex<double> correction_;  // m/s^2, of this step
  int head_ = 0;
  ControllerState state_;
};

/// Builds the controller a design describes. Throws Error for unknown names, parameters out of range, a law
/// that needs the input gain when it is not known, delays longer than Controller::kMaxDelay samples.
Controller make_controller(const ControllerDesign& design);

}  // namespace whirl::control
