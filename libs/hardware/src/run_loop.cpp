#include "whirl/hardware/run_loop.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/hardware/at_rest.hpp"
#include "whirl/hardware/loop_samples.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/loop_control.hpp"

namespace whirl::hardware {
namespace {

constexpr std::int64_t kAfterTrip = 500'000'000;  // ns that are still recorded when the force is zero
constexpr std::int64_t kJump = 1'000'000'000;     // ns by which a board's clock may be ahead of what has passed
constexpr const char *kStopped = "stopped by a signal", *kSilent = "the board does not answer";

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
  double seconds = 0, patience = 0;                     ///< LoopRunOptions
  bool attended() const { return control != &nobody; }  ///< somebody may clear a trip
  bool ends() const { return stop() || abandon; }       ///< is wanted to
};

/// After each cycle: is the board lost, or has it said nothing for too long?
bool gone(BoardSilence& silence, const rt::HardwareRig& rig, std::int64_t now) noexcept {
  return silence.too_long(rig.board().tick, now) || rig.fault() == rt::kBoardLost;
}

/// The cycles without force before the run, the last of them `r`: sensors and board are checked. Why there is no run;
/// empty: they are fit for it.
template <class Loop, class Clock>
const char* settle(const IoSettings& io, rt::HardwareRig& rig, Loop& loop, const Clock& clock, BoardSilence& silence,
                   const Shared& shared, rt::CycleRecord& r) {
  r.measurement.valid = false;
  // A machine that was busy elsewhere at this very moment may see an old sample: the next one is waited for.
  const auto unfit = [&] { return !r.measurement.valid && rig.fault() == Fault::none; };
  const auto early = [&] { return io.clock == "lockstep" && rig.board().tick % kLockstepCycle != 0; };
  const int longest = std::max(10 * io.settle, io.settle + static_cast<int>(kLockstepCycle));
  // The board answers to whoever commands it: unasked, its first tick would be waited for in vain for a watchdog's
  // time.
  rig.write({});
  for (int k = 0; k < io.settle || ((unfit() || early()) && k < longest); ++k) {
    if (shared.ends()) return kStopped;
    r = loop.cycle();
    if (gone(silence, rig, clock.started())) break;
  }
  if (shared.ends()) return kStopped;
  if (rig.fault() == rt::kEncoderStuck) return "the tacho is lost: its pulses are not followed";
  if (rig.fault() != Fault::none) return kSilent;
  return r.measurement.valid ? "" : "a displacement is not valid";
}

template <class Law, class Clock>
void cycles(const IoSettings& io, rt::HardwareRig& rig, Law& law, Clock& clock, Shared& shared) {
  LoopOutcome& out = shared.outcome;
  rt::ControlledLaw controlled(law, *shared.control);
  rt::Loop loop(rig, controlled, clock, io.limits(), io.loop());
  constexpr bool kControls = std::is_same_v<Law, control::Controller>;
  rt::CycleRecord r;
  BoardSilence silence(rt::WallTime{}.now(), static_cast<std::int64_t>(1e9 * shared.patience) + io.watchdog_ns());
  out.reason = settle(io, rig, loop, clock, silence, shared, r);
  if (out.reason.empty()) {
    if (kControls) {
      out.armed = loop.arm();
    } else {
      rig.start();
    }
  }
  const long first = r.tick + 1;
  // Nothing of the machine's own speed gets into a run in lockstep.
  const bool lockstep = io.clock == "lockstep";
  const std::int64_t period = std::llround(1e9 / io.rate);
  const auto time_of = [&](std::int64_t machine) { return lockstep ? period * (r.tick - first + 1) : machine; };
  for (int i = 0; i < 2; ++i) out.inputs[static_cast<std::size_t>(i)] = rig.state(i);
  const double seconds = shared.seconds;
  long last = seconds > 0 ? first + std::lround(seconds * io.rate) : std::numeric_limits<long>::max();
  const bool by_board = io.hardware.position[0].laser.device.empty() || io.hardware.position[1].laser.device.empty();
  std::int64_t tripped = 0, before = clock.started();  // when; start of the cycle before
  while (out.reason.empty()) {
    shared.control->apply(loop, [&]() noexcept { law.reset(); });
    r = loop.cycle();
    const std::int64_t now = time_of(clock.started());
    rt::LoopSample s = sample_of(r, time_of(clock.scheduled()), time_of(clock.started()));
    if constexpr (kControls) add_internals(s, law);
    s.tick -= first;
    // What a silent board said last is no sample.
    if (by_board && rig.fault() == Fault::watchdog) s.flags &= ~static_cast<std::int32_t>(rt::kValid);
    shared.queue.push(s);
    // Ticks of a board's clock that was set forward are no time that has passed.
    const std::int64_t passed = clock.started() - before;
    before = clock.started();
    if (!lockstep && period * r.missed > passed + kJump && seconds > 0) last += r.missed - passed / period;
    if (r.trip != out.trip) {
      out.trip = r.trip;
      tripped = r.trip != Fault::none ? now : 0;
      if (tripped > 0) out.trip_tick = s.tick;
      for (int i = 0; i < 2; ++i) out.inputs[static_cast<std::size_t>(i)] = rig.state(i);
    }
    if (r.releasing) tripped = now;
    const bool asked_to_end = shared.ends();
    if (asked_to_end && out.trip == Fault::none) {
      if (!loop.armed()) break;
      loop.stop();
    }
    if (!kControls && gone(silence, rig, clock.started())) {
      out.cut_short = true;
      out.reason = kSilent;
    }
    // In lockstep a rig that has gone away brings no more ticks either.
    const bool enough = now - tripped > kAfterTrip || (lockstep && clock.own_fault() == Fault::watchdog);
    const bool recorded = tripped > 0 && enough && (asked_to_end || !shared.attended());
    if (rig.done() || r.tick >= last || recorded) break;
  }
  out.timing = clock.timing();
}

template <class Law>
void with_clock(const IoSettings& io, rt::HardwareRig& rig, Law& law, Shared& shared) {
  const rt::RealtimeThread realtime(io.realtime);
  shared.outcome.granted = realtime.granted();
  shared.outcome.refused = realtime.refused();
  shared.ready = true;
  rt::WallTime time;
  if (io.clock == "wall") {
    rt::ControlledClock<rt::PacedClock<rt::WallTime>> clock(*shared.control, time, io.pace());
    cycles(io, rig, law, clock, shared);
  } else {
    rt::ControlledClock<rt::SampleClock<rt::HardwareRig, rt::WallTime>> clock(*shared.control, rig, time, io.pace(),
                                                                              io.watchdog_ns());
    cycles(io, rig, law, clock, shared);
  }
}

std::string why_ended(const Shared& shared, const rt::HardwareRig& rig) {
  const Fault trip = shared.outcome.trip;
  return shared.stop()              ? kStopped
         : trip == Fault::requested ? "stopped by the user"
         : trip != Fault::none      ? "trip: " + std::string(to_string(trip))
         : rig.done()               ? "the run is over"
                                    : "the time is over";
}

}  // namespace

LoopOutcome run_loop(const IoSettings& io, rt::HardwareRig& rig, control::Controller* controller,
                     const LoopRunOptions& options) {
  Shared shared;
  if (options.control) shared.control = options.control;
  shared.stop = options.stop;
  shared.seconds = options.seconds;
  shared.patience = options.patience;
  const BrokenPipeIgnored no_signal;  // what is said meanwhile may go nowhere
  std::thread thread([&] {
    NoController none;
    try {
      if (controller) {
        with_clock(io, rig, *controller, shared);
      } else {
        with_clock(io, rig, none, shared);
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
  std::string failure;
  // What is done with a cycle afterwards must not take the force from the rotor.
  const auto aside = [&](auto&& act) {
    try {
      act();
    } catch (const std::exception& e) {
      if (failure.empty()) tell("whirl: {}; the loop runs on\n", e.what());
      failure = e.what();
    }
  };
  {
    const Joiner joiner{shared, thread};
    bool told = false;
    rt::LoopSample s;
    for (bool over = false; !over;) {
      over = shared.over;
      if (shared.ready && !told) {
        told = true;
        aside([&] {
          if (options.started) options.started(shared.outcome);
        });
      }
      while (shared.queue.pop(s)) {
        aside([&] {
          if (options.take) options.take(s);
        });
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
  if (!failure.empty()) throw Error(failure);
  out.dropped_records = shared.queue.dropped();
  if (out.reason.empty()) out.reason = why_ended(shared, rig);
  return out;
}

}  // namespace whirl::hardware
