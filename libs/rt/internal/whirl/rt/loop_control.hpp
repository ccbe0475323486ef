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
/// it. Nobody has to be there: an untouched LoopControl changes nothing. The order in which the wishes were given
/// decides, whenever the loop looks.
class LoopControl {
 public:
  /// Zero force from the cycle that comes next on; latched until clear().
  void trip() noexcept {
    wish([](unsigned w) { return w | kTrip; });
  }
  /// Refused while a trip is latched, by the loop when it is one of its own.
  void arm() noexcept {
    wish([](unsigned w) { return (w & kTrip) != 0 ? w : w | now(w, kArm); });
  }
  /// Zero force, no trip.
  void disarm() noexcept {
    wish([](unsigned w) { return (w & kTrip) != 0 ? w : disarmed(w); });
  }
  /// Takes back a trip of any reason; the loop then stays disarmed.
  void clear() noexcept {
    wish([](unsigned w) { return ((w & kTrip) != 0 ? (disarmed(w) & ~kTrip) | kTakenBack : w) | kClear; });
  }
  /// Largest force per axis, N; infinity: the controller's own limit alone.
  void set_force_limit(double newton) noexcept { force_limit_.store(newton, std::memory_order_relaxed); }

  bool tripped() const noexcept { return (word() & kTrip) != 0; }
  /// The cycle that comes next must send zero: also for a trip that was taken back before the loop looked.
  bool trips() const noexcept { return (word() & (kTrip | kTakenBack)) != 0; }
  double force_limit() const noexcept { return force_limit_.load(std::memory_order_relaxed); }

  /// The loop's thread, between two cycles. `reset` is called before the loop is armed again: the controller has not
  /// seen the motion since it was disarmed.
  template <class Loop, class Reset>
  void apply(Loop& loop, Reset&& reset) noexcept {
    if ((word() & ~kTrip) == 0) return;
    const unsigned asked = word_.fetch_and(kTrip, std::memory_order_acq_rel);
    const auto act = [&](unsigned what) {
      if ((what & kDisarm) != 0) loop.disarm();
      if ((what & kArm) == 0 || (asked & kTrip) != 0 || loop.armed() || loop.safety().trip != Fault::none) return;
      reset();
      loop.arm();
    };
    act(asked);
    if ((asked & kClear) == 0) return;
    loop.clear();
    act(asked >> kAfterClear);
  }

 private:
  // One word, so that each wish takes its place in the order at once: what was asked before a clear, the clear, and
  // what was asked after it. A second clear finds only a person's own trip, which it can take back by itself.
  static constexpr unsigned kArm = 1, kDisarm = 2, kClear = 16, kTrip = 32, kTakenBack = 64;
  static constexpr unsigned kAfterClear = 2;  // bits by which arm and disarm after the clear lie higher
  static constexpr unsigned now(unsigned w, unsigned what) noexcept {
    return (w & kClear) != 0 ? what << kAfterClear : what;
  }
  static constexpr unsigned disarmed(unsigned w) noexcept { return (w & ~now(w, kArm)) | now(w, kDisarm); }
  template <class Change>
  void wish(Change change) noexcept {
    unsigned w = word_.load(std::memory_order_relaxed);
    while (!word_.compare_exchange_weak(w, change(w), std::memory_order_acq_rel, std::memory_order_relaxed)) {
    }
  }
  unsigned word() const noexcept { return word_.load(std::memory_order_acquire); }

  std::atomic<unsigned> word_{0};
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
  /// What the clock finds by itself.
  Fault own_fault() const noexcept {
    if constexpr (requires(const Clock& c) { c.fault(); }) return Clock::fault();
    return Fault::none;
  }
  /// The person's trip comes first: it takes the force at once, which other reasons may let fade.
  Fault fault() const noexcept { return control_.trips() ? Fault::requested : own_fault(); }

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
