#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "whirl/core/control_types.hpp"
#include "whirl/core/expected.hpp"

namespace whirl::rt {

/// What a person asks of a running loop. Set from any thread; the loop looks at it once per cycle and never waits for
/// it. Nobody has to be there: an untouched LoopControl changes nothing.
class LoopControl {
 public:
  /// Zero force from the cycle that comes next on; latched until clear().
  void trip() noexcept { tripped_.store(true, std::memory_order_release); }
  void arm() noexcept { ask(kArm); }        ///< refused by the loop while a trip is latched
  void disarm() noexcept { ask(kDisarm); }  ///< zero force, no trip
  void clear() noexcept { ask(kClear); }    ///< takes back a trip of any reason; the loop stays disarmed
  /// Largest force per axis, N; infinity: the controller's own limit alone.
  void set_force_limit(double newton) noexcept { force_limit_.store(newton, std::memory_order_relaxed); }

  bool tripped() const noexcept { return tripped_.load(std::memory_order_acquire); }
  double force_limit() const noexcept { return force_limit_.load(std::memory_order_relaxed); }

  /// The loop's thread, between two cycles. Disarm wins over arm. `reset` is called before the loop is armed again: the
  /// controller has not seen the motion since it was disarmed.
  template <class Loop, class Reset>
  void apply(Loop& loop, Reset&& reset) noexcept {
    const unsigned asked = asked_.exchange(0, std::memory_order_acq_rel);
    if (asked == 0) return;
    if (asked & kClear) {
      tripped_.store(false, std::memory_order_release);
      loop.clear();
      loop.disarm();
    }
    if (asked & kDisarm) {
      loop.disarm();
    } else if ((asked & kArm) && !tripped() && !loop.armed()) {
      reset();
      loop.arm();
    }
  }

 private:
  static constexpr unsigned kArm = 1, kDisarm = 2, kClear = 4;
  void ask(unsigned what) noexcept { asked_.fetch_or(what, std::memory_order_acq_rel); }

  std::atomic<bool> tripped_{false};
  std::atomic<unsigned> asked_{0};
  std::atomic<double> force_limit_{std::numeric_limits<double>::infinity()};
};

/// A clock of the loop that also brings the trip asked for by a person: what comes while the loop waits for a tick acts
/// in the cycle of that tick.
template <class Clock>
class ControlledClock : public Clock {
 public:
  template <class... Arguments>
  explicit ControlledClock(const LoopControl& control, Arguments&&... arguments) noexcept
      : Clock(std::forward<Arguments>(arguments)...), control_(control) {}
  Fault fault() const noexcept {
    Fault own = Fault::none;
    if constexpr (requires(const Clock& c) { c.fault(); }) own = Clock::fault();
    return own != Fault::none ? own : control_.tripped() ? Fault::requested : Fault::none;
  }

 private:
  const LoopControl& control_;
};

/// A controller under the force limit that a person may lower while the loop runs.
template <class Law>
class ControlledLaw {
 public:
  ControlledLaw(Law& law, const LoopControl& control) noexcept : law_(law), control_(control) {}
  Expected<Command, Fault> step(const Measurement& m) noexcept {
    const Expected<Command, Fault> request = law_.step(m);
    const double limit = control_.force_limit();
    if (!request || !(std::abs(request->ux) > limit || std::abs(request->uy) > limit)) return request;
    const Command u{std::clamp(request->ux, -limit, limit), std::clamp(request->uy, -limit, limit)};
    law_.applied(u);
    return u;
  }
  void applied(const Command& u) noexcept { law_.applied(u); }

 private:
  Law& law_;
  const LoopControl& control_;
};

}  // namespace whirl::rt
