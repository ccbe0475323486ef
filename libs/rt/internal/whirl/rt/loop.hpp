#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"
#include "whirl/rt/faults.hpp"
#include "whirl/rt/release.hpp"
#include "whirl/rt/safety.hpp"

namespace whirl::rt {

/// One cycle as it happened.
struct CycleRecord {
  long tick = 0;
  Measurement measurement;
  Expected<Command, Fault> request =
      Command{};  ///< by the controller; fault when it refused or the loop had tripped; zero when disarmed
  Command sent;
  Fault trip = Fault::none;
  bool limited = false;
  bool armed = false;
  bool releasing = false;  ///< tripped, and the force fades
  long missed = 0;         ///< ticks left out before this one
};

/// What a law that counts on its sample time h is told after ticks were left out. With either, the first commands after
/// a gap are bounded (GapBound).
enum class DtPolicy : std::uint8_t {
  nominal,  ///< nothing: every step stands for h, and the velocity after a gap of n ticks is taken n + 1 times too
            ///< large
  fill,  ///< one step per tick left out, with the motion between the last sample and this one (bridge()), so that its
         ///< time stays true; at most LoopOptions::max_fill
};

struct LoopOptions {
  bool armed = true;  ///< from the first cycle on
  DtPolicy dt = DtPolicy::nominal;
  long max_fill = 64;
  long max_gap = 100;         ///< ticks left out at once after which the loop trips (kGap); 0 = never
  double sample_time = 1e-3;  ///< h, s; used by DtPolicy::fill and by the release
  long release = 0;           ///< ticks in which the force fades after a trip (SynchronousRelease); 0: zero at once
};

/// After which faults the force may fade. Not when the force itself may be what is wrong.
constexpr bool may_release(Fault f) noexcept {
  return f == Fault::stale_sensor || f == Fault::overrun || f == Fault::watchdog || f == Fault::requested ||
         f == kGap || f == kEncoderStuck;
}

/// What the sensors would have shown a share `part` (0 to 1) of the way from one valid sample to the next: angle and
/// speed as a cubic through both ends, the displacement linear in the frame that turns with the rotor, because most of
/// it is synchronous. A straight line between two points of an orbit would cut through it.
inline Measurement bridge(const Measurement& from, const Measurement& to, double part) noexcept {
  const double T = to.t - from.t, p = part, q = 1 - part;
  Measurement m = to;
  m.t = from.t + part * T;
  // The last angle may have been wrapped: it is taken within half a turn of where the speed leads.
  const double led = from.beta + 0.5 * (from.omega + to.omega) * T;
  const double end = led + std::remainder(to.beta - led, 2 * std::numbers::pi);
  // Hermite's cubic: both angles, both speeds.
  m.beta = q * q * ((1 + 2 * p) * from.beta + p * T * from.omega) + p * p * ((1 + 2 * q) * end - q * T * to.omega);
  m.omega = q * from.omega + p * to.omega;
  m.omega_dot = q * from.omega_dot + p * to.omega_dot;
  const auto turned = [](const Measurement& z, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return Command{c * z.x - s * z.y, s * z.x + c * z.y};
  };
  const Command a = turned(from, m.beta - from.beta), b = turned(to, m.beta - end);
  m.x = q * a.ux + p * b.ux;
  m.y = q * a.uy + p * b.uy;
  return m;
}

/// Longest gap, s, in which a force that stands still is better than none on a rotor at `omega`, rad/s: a sixth of a
/// turn. Its error against the force that turns is |e^{i omega t} - 1| times it, which is 1 there; none at all errs
/// by 1.
inline double longest_held_gap(double omega) noexcept {
  return omega != 0 ? std::numbers::pi / (3 * std::abs(omega)) : std::numeric_limits<double>::infinity();
}

/// Bound of the first commands after a gap: what the law sees of the motion is then the poorest. For as many cycles as
/// ticks were left out (at least kLeast), each axis is kept within kFactor times the largest force of the last fifth of
/// a second, or a tenth of the force limit when that is more.
class GapBound {
 public:
  static constexpr double kFactor = 1.15, kMemory = 0.2, kGrowth = 0.5;  // 1, s, s
  static constexpr long kLeast = 5;

  explicit GapBound(double sample_time) noexcept
      : keep_(std::exp(-sample_time / kMemory)), grow_(std::exp(sample_time / kGrowth)) {}

  /// Once a cycle, with the command the gate let pass; true when it was bounded.
  bool apply(long missed, double force_limit, Command& u) noexcept {
    if (missed > 0) left_ = std::max(left_, std::max(kLeast, missed));
    bool bounded = false;
    if (left_ > 0) {
      --left_;
      const double most = std::max(kFactor * recent_, 0.1 * force_limit);
      const Command asked = u;
      if (most > 0) u = {std::clamp(u.ux, -most, most), std::clamp(u.uy, -most, most)};
      bounded = u.ux != asked.ux || u.uy != asked.uy;
      if (bounded) recent_ *= grow_;  // a loop that has gaps all the time must still follow a growing motion
    } else {
      recent_ = std::max({keep_ * recent_, std::abs(u.ux), std::abs(u.uy)});
    }
    return bounded;
  }

 private:
  double keep_, grow_, recent_ = 0;
  long left_ = 0;
};

/// The closed loop, the same in simulation and on hardware: wait -> read -> controller -> safety -> write ->
/// advance.
///
/// Rig: `Measurement read()`, `void write(Command)`, `void advance()` (next tick; nothing on hardware); it may
/// have `Fault fault()` (a reason to trip, e.g. its watchdog), `void arm(bool)`, `void left_out(long)`, told before
/// `read()` how many ticks passed without a cycle, and `bool hold(const
/// SynchronousRelease&)`: told every cycle what turns with the rotor in the force, it returns whether it sends that,
/// turned on, in ticks for which no command comes (else the last command stands still, see longest_held_gap).
/// Controller: `Expected<Command, Fault> step(const Measurement&)`, `void applied(const Command&)`. Clock: `long
/// wait()`; it may have `Fault fault()`. All noexcept; a cycle allocates nothing.
///
/// Disarmed, the loop reads and sends zero; the controller is not asked. A trip disarms and latches with its
/// reason and tick: zero is sent from then on (with LoopOptions::release after the force has faded; at once when the
/// displacement is too large, a number is not finite, another fault joins, the clock gets no samples or brings a
/// person's trip), and when the loop ends. `clear()` then `arm()` start again.
template <class Rig, class Controller, class Clock>
class Loop {
 public:
  Loop(Rig& rig, Controller& controller, Clock& clock, const SafetyLimits& limits = {},
       const LoopOptions& options = {}) noexcept
      : rig_(rig),
        controller_(controller),
        clock_(clock),
        limits_(limits),
        options_(options),
        release_(options.sample_time),
        bound_(options.sample_time),
        armed_(options.armed) {
    tell_rig();
  }
  ~Loop() {
    armed_ = false;
    tell_rig();
    rig_.write({});
  }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  CycleRecord cycle() noexcept {
    static_assert(noexcept(rig_.read())&& noexcept(rig_.write(Command{}))&& noexcept(rig_.advance()));
    static_assert(noexcept(controller_.step(Measurement{}))&& noexcept(clock_.wait()));
    CycleRecord r;
    r.missed = clock_.wait();
    tick_ += 1 + r.missed;
    r.tick = tick_;
    if constexpr (requires { rig_.left_out(r.missed); }) rig_.left_out(r.missed);
    r.measurement = rig_.read();
    r.armed = armed_;
    SafetyDecision decision;
    Fault clock_fault = Fault::none, found = Fault::none;
    if constexpr (requires { clock_.fault(); }) found = clock_fault = clock_.fault();
    if constexpr (requires { rig_.fault(); }) {
      // That a lost board brings no samples is no reason of its own.
      const Fault of_rig = rig_.fault();
      found = of_rig == kBoardLost ? of_rig : first(found, of_rig);
    }
    if (armed_ && options_.max_gap > 0 && r.missed > options_.max_gap) found = first(found, kGap);
    // No samples and so no time to fade in, or a person's trip.
    const bool at_once = clock_fault == Fault::watchdog || clock_fault == Fault::requested;
    const SynchronousRelease held = release_;
    if (follows()) release_.follow(r.measurement, 1 + r.missed);
    if (armed_) {
      fill(r.measurement, r.missed, held);
      r.request = controller_.step(r.measurement);
      decision = decide(limits_, safety_, r.measurement, r.request, tick_, first(requested_, found));
      if (decision.state.trip == Fault::none && bound_.apply(r.missed, limits_.force, decision.command)) {
        decision.limited = true;
        decision.state.last = decision.command;
      }
      before_ = r.measurement;
    } else {
      if (safety_.trip != Fault::none) r.request = Expected<Command, Fault>::fault(safety_.trip);
      decision.state = safety_;
      decision.state.last = {};
    }
    if (armed_ && decision.state.trip != Fault::none) {
      armed_ = false;
      fading_ = !at_once && may_release(decision.state.trip) ? options_.release : 0;
      if (fading_ == 0) tell_rig();
    } else if (follows() && armed_ && r.measurement.valid) {
      release_.learn(decision.command);
    }
    if (fading_ > 0) {
      const bool alone = !at_once && (found == Fault::none || found == decision.state.trip);
      decision.command = fade(r.missed, alone && displacement_fault(limits_, r.measurement) == Fault::none);
      r.releasing = fading_ > 0;
    }
    rig_.write(decision.command);
    if constexpr (kHolds) turning_ = rig_.hold(armed_ ? release_ : SynchronousRelease(options_.sample_time));
    safety_ = decision.state;
    r.sent = decision.command;
    r.trip = safety_.trip;
    r.limited = decision.limited;
    if (decision.limited) controller_.applied(decision.command);
    rig_.advance();
    return r;
  }

  /// Trips at the next cycle, with `reason`.
  void stop(Fault reason = Fault::requested) noexcept { requested_ = reason; }
  /// Lets the controller act from the next cycle on. False, and nothing happens, while a trip is latched.
  bool arm() noexcept {
    if (safety_.trip != Fault::none) return false;
    armed_ = true;
    before_.valid = false;
    release_.forget();
    bound_ = GapBound(options_.sample_time);
    safety_.invalid = 0;
    tell_rig();
    return true;
  }
  /// Zero force from the next cycle on, without a trip.
  void disarm() noexcept {
    armed_ = false;
    fading_ = 0;
    tell_rig();
  }
  /// Clears a latched trip; the loop stays disarmed.
  void clear() noexcept {
    if (safety_.trip != Fault::none) disarm();
    safety_ = {};
    requested_ = Fault::none;
  }
  bool armed() const noexcept { return armed_; }
  bool releasing() const noexcept { return fading_ > 0; }
  const SafetyState& safety() const noexcept { return safety_; }

 private:
  static constexpr bool kHolds = requires(Rig & rig, const SynchronousRelease& force) { rig.hold(force); };
  bool follows() const noexcept { return kHolds || options_.release > 0; }
  static constexpr Fault first(Fault a, Fault b) noexcept { return a != Fault::none ? a : b; }
  void tell_rig() noexcept {
    if constexpr (requires { rig_.arm(true); }) rig_.arm(armed_);
  }
  // The force while it fades; its end disarms the rig.
  Command fade(long missed, bool go_on) noexcept {
    fading_ = go_on ? std::max(fading_ - 1 - missed, 0L) : 0;
    if (fading_ == 0) {
      tell_rig();
      return {};
    }
    Command u = release_.force(static_cast<double>(fading_) / static_cast<double>(options_.release));
    limit_force(limits_, u);
    return u;
  }
  // The controller's own time over `missed` ticks: the motion between two samples, or lost samples when one of them is
  // no sample; the angle then goes on at its speed. `held`: the force that turned on, where the rig does that.
  void fill(const Measurement& now, long missed, SynchronousRelease held) noexcept {
    if (options_.dt != DtPolicy::fill) return;
    const double all = static_cast<double>(missed + 1);
    Measurement from = before_;
    from.t = now.t - all * options_.sample_time;
    if (missed > options_.max_fill) held.turn(missed - options_.max_fill);
    for (long back = std::min(missed, options_.max_fill); back > 0; --back) {
      const double ago = static_cast<double>(back) * options_.sample_time;
      Measurement m = now;
      if (now.valid && before_.valid) {
        m = bridge(from, now, 1 - static_cast<double>(back) / all);
      } else {
        m.valid = false;
        m.t -= ago;
        m.beta -= (now.omega - 0.5 * now.omega_dot * ago) * ago;
        m.omega -= now.omega_dot * ago;
      }
      (void)controller_.step(m);
      Command acted = safety_.last;
      if (turning_) {
        held.turn(1);
        acted = held.force(1);
        limit_force(limits_, acted);
      }
      controller_.applied(acted);
    }
  }

  Rig& rig_;
  Controller& controller_;
  Clock& clock_;
  SafetyLimits limits_;
  LoopOptions options_;
  SynchronousRelease release_;
  GapBound bound_;
  Measurement before_{.valid = false};
  SafetyState safety_;
  Fault requested_ = Fault::none;
  bool armed_, turning_ = false;
  long fading_ = 0;  // ticks until the force is zero
  long tick_ = -1;
};

}  // namespace whirl::rt
