#include "whirl/hardware/run_loop.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/hardware/loop_samples.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/loop_control.hpp"

namespace whirl::hardware {
namespace {

constexpr std::int64_t kAfterTrip = 500'000'000;  // ns that are still recorded when the force is zero

/// Stands in when there is nothing to control.
struct NoController {
  Expected<Command, Fault> step(const Measurement&) noexcept { return Command{}; }
  void applied(const Command&) noexcept {}
  void reset() noexcept {}
};

/// What both threads know.
struct Shared {
  rt::RecordQueue<rt::LoopSample> queue{1 << 14};
  std::atomic<bool> ready{false}, over{false}, abandon{false};
  LoopOutcome outcome;
  std::exception_ptr failure;  ///< what was thrown in the thread of the loop
  rt::LoopControl nobody;
  rt::LoopControl* control = &nobody;
  StopRequest stop = never_stop;
  bool attended() const { return control != &nobody; }  ///< somebody may clear a trip
};

template <class Law, class Clock>
void cycles(const IoSettings& io, rt::HardwareRig& rig, Law& law, Clock& clock, double seconds, Shared& shared) {
  LoopOutcome& out = shared.outcome;
  rt::ControlledLaw controlled(law, *shared.control);
  rt::Loop loop(rig, controlled, clock, io.limits(), io.loop());
  constexpr bool kControls = std::is_same_v<Law, control::Controller>;
  rt::CycleRecord r;
  // A machine that was busy elsewhere at this very moment may see an old sample: the next one is waited for.
  const auto unfit = [&] { return !r.measurement.valid && rig.fault() == Fault::none; };
  const bool lockstep = io.clock == "lockstep";
  const auto early = [&] { return lockstep && rig.board().tick % kLockstepCycle != 0; };
  const int longest = std::max(10 * io.settle, io.settle + static_cast<int>(kLockstepCycle));
  // The board answers to whoever commands it: unasked, its first tick would be waited for in vain for a watchdog's
  // time.
  rig.write({});
  for (int k = 0; (k < io.settle || ((unfit() || early()) && k < longest)) && !shared.stop(); ++k) {
    r = loop.cycle();
    if (rig.fault() == rt::kBoardLost) break;
  }
  const long first = r.tick + 1;
  // Nothing of the machine's own speed gets into a run in lockstep.
  const std::int64_t period = std::llround(1e9 / io.rate);
  const auto time_of = [&](std::int64_t machine) { return lockstep ? period * (r.tick - first + 1) : machine; };
  if (!r.measurement.valid || rig.fault() != Fault::none) {
    out.reason = rig.fault() != Fault::none ? "the board does not answer" : "a displacement is not valid";
  } else if (kControls) {
    out.armed = loop.arm();
  } else {
    rig.start();
  }
  for (int i = 0; i < 2; ++i) out.inputs[static_cast<std::size_t>(i)] = rig.state(i);
  const long last = seconds > 0 ? first + std::lround(seconds * io.rate) : std::numeric_limits<long>::max();
  std::int64_t tripped = 0;  // when
  while (out.reason.empty()) {
    shared.control->apply(loop, [&]() noexcept { law.reset(); });
    r = loop.cycle();
    const std::int64_t now = time_of(clock.started());
    rt::LoopSample s = sample_of(r, time_of(clock.scheduled()), time_of(clock.started()));
    if constexpr (kControls) add_internals(s, law);
    s.tick -= first;
    shared.queue.push(s);
    if (r.trip != out.trip) {
      out.trip = r.trip;
      tripped = r.trip != Fault::none ? now : 0;
      if (tripped > 0) out.trip_tick = s.tick;
      for (int i = 0; i < 2; ++i) out.inputs[static_cast<std::size_t>(i)] = rig.state(i);
    }
    if (r.releasing) tripped = now;
    const bool asked_to_end = shared.stop() || shared.abandon;
    if (asked_to_end && out.trip == Fault::none) {
      if (!loop.armed()) break;
      loop.stop();
    }
    // In lockstep a rig that has gone away brings no more ticks either.
    const bool enough = now - tripped > kAfterTrip || (lockstep && clock.fault() == Fault::watchdog);
    const bool recorded = tripped > 0 && enough && (asked_to_end || !shared.attended());
    if (rig.done() || r.tick >= last || recorded) break;
  }
  out.timing = clock.timing();
}

template <class Law>
void with_clock(const IoSettings& io, rt::HardwareRig& rig, Law& law, double seconds, Shared& shared) {
  const rt::RealtimeThread realtime(io.realtime);
  shared.outcome.granted = realtime.granted();
  shared.outcome.refused = realtime.refused();
  shared.ready = true;
  rt::WallTime time;
  if (io.clock == "wall") {
    rt::ControlledClock<rt::PacedClock<rt::WallTime>> clock(*shared.control, time, io.pace());
    cycles(io, rig, law, clock, seconds, shared);
  } else {
    rt::ControlledClock<rt::SampleClock<rt::HardwareRig, rt::WallTime>> clock(*shared.control, rig, time, io.pace(),
                                                                              io.watchdog_ns());
    cycles(io, rig, law, clock, seconds, shared);
  }
}

}  // namespace

LoopOutcome run_loop(const IoSettings& io, rt::HardwareRig& rig, control::Controller* controller,
                     const LoopRunOptions& options) {
  Shared shared;
  if (options.control) shared.control = options.control;
  shared.stop = options.stop;
  std::thread thread([&] {
    NoController none;
    try {
      if (controller) {
        with_clock(io, rig, *controller, options.seconds, shared);
      } else {
        with_clock(io, rig, none, options.seconds, shared);
      }
    } catch (...) {  // ~Loop has sent zero where there was a force; nothing is allocated, memory may be what is missing
      rig.arm(false);
      rig.write({});
      shared.failure = std::current_exception();
    }
    shared.over = true;
  });
  // Whatever happens here, the loop comes to its end and the rig to zero.
  struct Joiner {
    Shared& shared;
    std::thread& thread;
    ~Joiner() {
      shared.abandon = true;
      thread.join();
    }
  };
  std::string take_failure;
  {
    const Joiner joiner{shared, thread};
    bool told = false;
    rt::LoopSample s;
    for (bool over = false; !over;) {
      over = shared.over;
      if (shared.ready && !told && options.started) options.started(shared.outcome), told = true;
      while (shared.queue.pop(s)) {
        // What is done with a cycle afterwards must not take the force from the rotor.
        try {
          if (options.take) options.take(s);
        } catch (const std::exception& e) {
          if (take_failure.empty()) fmt::print(stderr, "whirl: {}; the loop runs on\n", e.what());
          take_failure = e.what();
        }
      }
      if (!over) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  LoopOutcome& out = shared.outcome;
  if (shared.failure) {
    try {
      std::rethrow_exception(shared.failure);
    } catch (const std::exception& e) {
      throw Error(fmt::format("the loop ended by an error: {}", e.what()));
    }
  }
  if (!take_failure.empty()) throw Error(take_failure);
  out.dropped_records = shared.queue.dropped();
  if (out.reason.empty()) {
    out.reason = shared.stop()                  ? "stopped by a signal"
                 : out.trip == Fault::requested ? "stopped by the user"
                 : out.trip != Fault::none      ? "trip: " + std::string(to_string(out.trip))
                 : rig.done()                   ? "the run is over"
                                                : "the time is over";
  }
  return out;
}

}  // namespace whirl::hardware
