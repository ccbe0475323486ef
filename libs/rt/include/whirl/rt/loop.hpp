#pragma once
#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"
#include "whirl/rt/safety.hpp"

namespace whirl {

/// One cycle as it happened.
struct CycleRecord {
  long tick = 0;
  Measurement measurement;
  Expected<Command, Fault> request =
      Command{};  ///< by the controller; fault when it refused or the loop had tripped
  Command sent;
  Fault trip = Fault::none;
  bool limited = false;
};

/// The closed loop, the same in simulation and on hardware: wait -> read -> controller -> safety -> write ->
/// advance.
///
/// Rig: `Measurement read()`, `void write(Command)`, `void advance()` (next tick; nothing on hardware).
/// Controller: `Expected<Command, Fault> step(const Measurement&)`, `void applied(const Command&)`. Clock:
/// `long wait()`. All noexcept; a cycle allocates nothing. A trip latches with its reason and tick: zero is
/// sent from then on, and when the loop ends.
template <class Rig, class Controller, class Clock>
class Loop {
 public:
  Loop(Rig& rig, Controller& controller, Clock& clock, const SafetyLimits& limits = {}) noexcept
      : rig_(rig), controller_(controller), clock_(clock), limits_(limits) {}
  ~Loop() { rig_.write({}); }
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;

  CycleRecord cycle() noexcept {
    static_assert(noexcept(rig_.read())&& noexcept(rig_.write(Command{}))&& noexcept(rig_.advance()));
    static_assert(noexcept(controller_.step(Measurement{}))&& noexcept(clock_.wait()));
    tick_ += 1 + clock_.wait();
    CycleRecord r;
    r.tick = tick_;
    r.measurement = rig_.read();
    r.request = safety_.trip == Fault::none ? controller_.step(r.measurement)
                                            : Expected<Command, Fault>::fault(safety_.trip);
    const SafetyDecision decision = decide(limits_, safety_, r.measurement, r.request, tick_);
    rig_.write(decision.command);
    safety_ = decision.state;
    r.sent = decision.command;
    r.trip = safety_.trip;
    r.limited = decision.limited;
    if (decision.limited) controller_.applied(decision.command);
    rig_.advance();
    return r;
  }

  void stop() noexcept {
    if (safety_.trip == Fault::none) safety_.trip = Fault::requested, safety_.trip_tick = tick_;
  }
  /// Clears a latched trip; the only way to arm again.
  void clear() noexcept { safety_ = {}; }
  const SafetyState& safety() const noexcept { return safety_; }

 private:
  Rig& rig_;
  Controller& controller_;
  Clock& clock_;
  SafetyLimits limits_;
  SafetyState safety_;
  long tick_ = -1;
};

}  // namespace whirl
