#pragma once
#include <algorithm>
#include <cstdint>

#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"
#include "whirl/rt/safety.hpp"

namespace whirl {

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
  long missed = 0;  ///< ticks left out before this one
};

/// What a law that counts on its sample time h is told after ticks were left out.
enum class DtPolicy : std::uint8_t {
  nominal,  ///< nothing: every step stands for h
  fill,     ///< one step with a lost sample per tick left out (at most LoopOptions::max_fill), so that its time stays true
};

struct LoopOptions {
  bool armed = true;  ///< from the first cycle on
  DtPolicy dt = DtPolicy::nominal;
  long max_fill = 16;
  double sample_time = 1e-3;  ///< h, s; used by DtPolicy::fill alone
};

/// The closed loop, the same in simulation and on hardware: wait -> read -> controller -> safety -> write ->
/// advance.
///
/// Rig: `Measurement read()`, `void write(Command)`, `void advance()` (next tick; nothing on hardware); it may
/// have `Fault fault()` (a reason to trip, e.g. its watchdog) and `void arm(bool)`. Controller:
/// `Expected<Command, Fault> step(const Measurement&)`, `void applied(const Command&)`. Clock: `long wait()`;
/// it may have `Fault fault()`. All noexcept; a cycle allocates nothing.
///
/// Disarmed, the loop reads and sends zero; the controller is not asked. A trip disarms and latches with its
/// reason and tick: zero is sent from then on, and when the loop ends. `clear()` then `arm()` start again.
template <class Rig, class Controller, class Clock>
class Loop {
 public:
  Loop(Rig& rig, Controller& controller, Clock& clock, const SafetyLimits& limits = {},
       const LoopOptions& options = {}) noexcept
      : rig_(rig), controller_(controller), clock_(clock), limits_(limits), options_(options), armed_(options.armed) {
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
    r.measurement = rig_.read();
    r.armed = armed_;
    SafetyDecision decision;
    if (armed_) {
      Fault outside = requested_;
      if constexpr (requires { clock_.fault(); }) outside = first(outside, clock_.fault());
      if constexpr (requires { rig_.fault(); }) outside = first(outside, rig_.fault());
      fill(r.measurement, r.missed);
      r.request = controller_.step(r.measurement);
      decision = decide(limits_, safety_, r.measurement, r.request, tick_, outside);
    } else {
      if (safety_.trip != Fault::none) r.request = Expected<Command, Fault>::fault(safety_.trip);
      decision.state = safety_;
      decision.state.last = {};
    }
    if (armed_ && decision.state.trip != Fault::none) {
      armed_ = false;
      tell_rig();
    }
    rig_.write(decision.command);
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
    safety_.invalid = 0;
    tell_rig();
    return true;
  }
  /// Zero force from the next cycle on, without a trip.
  void disarm() noexcept {
    armed_ = false;
    tell_rig();
  }
  /// Clears a latched trip; the loop stays disarmed.
  void clear() noexcept {
    safety_ = {};
    requested_ = Fault::none;
  }
  bool armed() const noexcept { return armed_; }
  const SafetyState& safety() const noexcept { return safety_; }

 private:
  static constexpr Fault first(Fault a, Fault b) noexcept { return a != Fault::none ? a : b; }
  void tell_rig() noexcept {
    if constexpr (requires { rig_.arm(true); }) rig_.arm(armed_);
  }
  // The controller's own time over `missed` ticks: samples are lost, the angle goes on at its speed.
  void fill(const Measurement& now, long missed) noexcept {
    if (options_.dt != DtPolicy::fill) return;
    for (long back = std::min(missed, options_.max_fill); back > 0; --back) {
      const double ago = static_cast<double>(back) * options_.sample_time;
      Measurement m = now;
      m.valid = false;
      m.t -= ago;
      m.beta -= (now.omega - 0.5 * now.omega_dot * ago) * ago;
      m.omega -= now.omega_dot * ago;
      (void)controller_.step(m);
      controller_.applied(safety_.last);
    }
  }

  Rig& rig_;
  Controller& controller_;
  Clock& clock_;
  SafetyLimits limits_;
  LoopOptions options_;
  SafetyState safety_;
  Fault requested_ = Fault::none;
  bool armed_;
  long tick_ = -1;
};

}  // namespace whirl
