#pragma once
#include <algorithm>
#include <cstdint>
#include <string_view>

#include "whirl/core/control_types.hpp"
#include "whirl/rt/histogram.hpp"

namespace whirl::rt {

/// What happens when a cycle is not done before the next is due.
enum class OverrunPolicy : std::uint8_t {
  skip,      ///< leave out the cycles that are past and go on at the next instant of the grid
  catch_up,  ///< run up to `max_catch_up` late cycles back to back, leave out what lies further back
  trip,      ///< as skip, and demand a trip after `trip_after` overruns in a row
};

struct PaceOptions {
  std::int64_t period = 1'000'000;  ///< ns
  OverrunPolicy overrun = OverrunPolicy::skip;
  int max_catch_up = 3;
  int trip_after = 10;
};

/// Where the grid stands. The instants are start + n period for ever: a late cycle never shifts them.
struct PaceState {
  std::int64_t next = 0;  ///< instant of the coming cycle, ns
  int in_a_row = 0;       ///< overruns without a cycle in time between them
};

/// What to do at `now`, with the cycle before it done.
struct PaceStep {
  bool sleep = false;   ///< until `at`; false: run at once
  std::int64_t at = 0;  ///< instant of this cycle, ns
  long missed = 0;      ///< instants left out
  Fault fault = Fault::none;
  PaceState state;  ///< for the next step
};

/// The overrun policy as a pure function of time.
constexpr PaceStep pace(const PaceOptions& o, const PaceState& s, std::int64_t now) noexcept {
  PaceStep out;
  out.state = s;
  const std::int64_t late = now - s.next;
  if (late <= 0) {
    out.sleep = true;
    out.state.in_a_row = 0;
  } else {
    out.state.in_a_row = s.in_a_row + 1;
    if (o.overrun == OverrunPolicy::catch_up) {
      const std::int64_t behind = late / o.period;
      out.missed = static_cast<long>(std::max<std::int64_t>(behind - o.max_catch_up, 0));
    } else {
      out.missed = static_cast<long>((late + o.period - 1) / o.period);
      out.sleep = true;
    }
    if (o.overrun == OverrunPolicy::trip && out.state.in_a_row >= o.trip_after) out.fault = Fault::overrun;
  }
  out.at = s.next + out.missed * o.period;
  out.state.next = out.at + o.period;
  return out;
}

/// How well a loop kept its time. Preallocated.
struct LoopTiming {
  Histogram latency;     ///< from the instant of the grid to the start of the cycle
  Histogram execution;   ///< from the start of a cycle to its end
  Histogram period;      ///< from start to start
  long executed = 0;     ///< cycles
  long missed = 0;       ///< instants of the grid left out
  long late_work = 0;    ///< overruns because the cycle took too long
  long late_wake = 0;    ///< overruns because the system woke the loop a period too late
  long late_source = 0;  ///< ticks were left out although the loop waited for them: samples late or lost on their way
};

/// Clock of a loop on an absolute grid. Time: `std::int64_t now()` and `void sleep_until(std::int64_t)`, ns,
/// noexcept; WallTime of realtime.hpp, or a simulated one in tests.
template <class Time>
class PacedClock {
 public:
  PacedClock(Time& time, const PaceOptions& options) noexcept : time_(time), options_(options) {
    state_.next = time.now() + options.period;
  }
  /// Sleeps until the next instant; returns the number of instants left out.
  long wait() noexcept {
    const std::int64_t entered = time_.now();
    if (started_ > 0) timing_.execution.add(entered - started_, tick_);
    const PaceStep step = pace(options_, state_, entered);
    if (entered > state_.next) ++timing_.late_work;
    state_ = step.state;
    fault_ = step.fault;
    long missed = step.missed;
    std::int64_t at = step.at, now = entered;
    if (step.sleep) {
      time_.sleep_until(step.at);
      now = time_.now();
      // Woken so late that whole instants are past: they are left out too, except for catching up.
      const std::int64_t behind = (now - at) / options_.period;
      if (behind > 0) {
        ++timing_.late_wake;
        if (options_.overrun != OverrunPolicy::catch_up) {
          missed += static_cast<long>(behind);
          at += behind * options_.period;
          state_.next = at + options_.period;
        }
      }
    }
    tick_ += 1 + missed;
    timing_.missed += missed;
    ++timing_.executed;
    timing_.latency.add(now - at, tick_);
    if (started_ > 0) timing_.period.add(now - started_, tick_);
    started_ = now;
    scheduled_ = at;
    return missed;
  }
  Fault fault() const noexcept { return fault_; }
  std::int64_t scheduled() const noexcept { return scheduled_; }  ///< instant of this cycle, ns
  std::int64_t started() const noexcept { return started_; }      ///< its start, ns
  const LoopTiming& timing() const noexcept { return timing_; }

 private:
  Time& time_;
  PaceOptions options_;
  PaceState state_;
  Fault fault_ = Fault::none;
  std::int64_t scheduled_ = 0, started_ = 0;
  long tick_ = -1;
  LoopTiming timing_;
};

/// Clock of a loop that the samples drive: the rig's `long wait(std::int64_t timeout)` blocks until the next
/// samples are there and returns how many ticks they advanced, 0 when none came within `timeout` ns.
template <class Rig, class Time>
class SampleClock {
 public:
  /// `watchdog` in ns: without samples for so long the clock demands a trip.
  SampleClock(Rig& rig, Time& time, const PaceOptions& options, std::int64_t watchdog) noexcept
      : rig_(rig), time_(time), options_(options), watchdog_(watchdog) {}
  long wait() noexcept {
    const std::int64_t entered = time_.now();
    if (started_ > 0) timing_.execution.add(entered - started_, tick_);
    const long advanced = rig_.wait(watchdog_);
    const std::int64_t now = time_.now();
    const long missed = std::max(advanced - 1, 0L);
    in_a_row_ = missed > 0 ? in_a_row_ + 1 : 0;
    fault_ = Fault::none;
    // Samples that came while the cycle before was still at work are its own fault.
    const bool by_work = started_ > 0 && entered - started_ > options_.period;
    if (missed > 0) ++(by_work ? timing_.late_work : timing_.late_source);
    if (options_.overrun == OverrunPolicy::trip && in_a_row_ >= options_.trip_after) fault_ = Fault::overrun;
    if (advanced == 0) fault_ = Fault::watchdog;
    tick_ += 1 + missed;
    timing_.missed += missed;
    ++timing_.executed;
    if (started_ > 0) timing_.period.add(now - started_, tick_);
    started_ = now;
    return missed;
  }
  Fault fault() const noexcept { return fault_; }
  std::int64_t scheduled() const noexcept { return started_; }
  std::int64_t started() const noexcept { return started_; }
  const LoopTiming& timing() const noexcept { return timing_; }

 private:
  Rig& rig_;
  Time& time_;
  PaceOptions options_;
  std::int64_t watchdog_;
  int in_a_row_ = 0;
  Fault fault_ = Fault::none;
  std::int64_t started_ = 0;
  long tick_ = -1;
  LoopTiming timing_;
};

}  // namespace whirl::rt
