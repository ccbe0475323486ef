#include "run_loop.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "stop_signal.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::app {
namespace {

constexpr std::int64_t kAfterTrip = 500'000'000;  // ns that are still recorded

/// Stands in when there is nothing to control.
struct NoController {
  Expected<Command, Fault> step(const Measurement&) noexcept { return Command{}; }
  void applied(const Command&) noexcept {}
};

LoopSample sample_of(const CycleRecord& r, std::int64_t scheduled, std::int64_t started) noexcept {
  LoopSample s;
  s.tick = r.tick;
  s.t = r.measurement.t;
  s.scheduled = 1e-9 * static_cast<double>(scheduled);
  s.started = 1e-9 * static_cast<double>(started);
  s.x = r.measurement.x, s.y = r.measurement.y;
  s.beta = r.measurement.beta, s.omega = r.measurement.omega, s.omega_dot = r.measurement.omega_dot;
  s.ux = r.sent.ux, s.uy = r.sent.uy;
  s.flags = (r.measurement.valid ? kValid : 0) | (r.armed ? kArmed : 0) | (r.limited ? kLimited : 0);
  s.trip = static_cast<std::int32_t>(r.trip);
  s.missed = static_cast<std::int32_t>(r.missed);
  return s;
}

void add_internals(LoopSample& s, const Controller& controller) noexcept {
  const ControllerState& c = controller.state();
  s.x_est = c.estimate.z.real(), s.y_est = c.estimate.z.imag();
  s.vx_est = c.estimate.v.real(), s.vy_est = c.estimate.v.imag();
  s.dx_est = c.estimate.d.real(), s.dy_est = c.estimate.d.imag();
  s.s_x = c.s.real(), s.s_y = c.s.imag();
  s.ux_requested = c.requested.real(), s.uy_requested = c.requested.imag();
  s.flags |= (c.saturated ? kSaturated : 0) | (c.held ? kHeld : 0);
}
void add_internals(LoopSample&, const NoController&) noexcept {}

/// What both threads know.
struct Shared {
  RecordQueue<LoopSample> queue{1 << 14};
  std::atomic<bool> ready{false}, over{false}, abandon{false};
  LoopOutcome outcome;
};

template <class Law, class Clock>
void cycles(const IoSettings& io, HardwareRig& rig, Law& law, Clock& clock, double seconds, Shared& shared) noexcept {
  LoopOutcome& out = shared.outcome;
  Loop loop(rig, law, clock, io.limits(), io.loop());
  constexpr bool kControls = std::is_same_v<Law, Controller>;
  CycleRecord r;
  for (int k = 0; k < io.settle && stop_signal() == 0; ++k) r = loop.cycle();
  const long first = r.tick + 1;
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
    r = loop.cycle();
    LoopSample s = sample_of(r, clock.scheduled(), clock.started());
    add_internals(s, law);
    s.tick -= first;
    shared.queue.push(s);
    if (r.trip != Fault::none && out.trip == Fault::none) {
      out.trip = r.trip;
      out.trip_tick = s.tick;
      for (int i = 0; i < 2; ++i) out.inputs[static_cast<std::size_t>(i)] = rig.state(i);
    }
    if ((stop_signal() != 0 || shared.abandon) && out.trip == Fault::none) {
      if (!kControls) break;
      loop.stop();
    }
    if (out.trip != Fault::none && tripped == 0) tripped = clock.started();
    if (rig.done() || r.tick >= last || (tripped > 0 && clock.started() - tripped > kAfterTrip)) break;
  }
  out.timing = clock.timing();
}

template <class Law>
void with_clock(const IoSettings& io, HardwareRig& rig, Law& law, double seconds, Shared& shared) {
  const RealtimeThread realtime(io.realtime);
  shared.outcome.granted = realtime.granted();
  shared.outcome.refused = realtime.refused();
  shared.ready = true;
  WallTime time;
  if (io.clock == "wall") {
    PacedClock clock(time, io.pace());
    cycles(io, rig, law, clock, seconds, shared);
  } else {
    SampleClock clock(rig, time, io.pace(), io.watchdog_ns());
    cycles(io, rig, law, clock, seconds, shared);
  }
}

}  // namespace

LoopOutcome run_loop(const IoSettings& io, HardwareRig& rig, Controller* controller, double seconds,
                     const std::function<void(const LoopSample&)>& take,
                     const std::function<void(const LoopOutcome&)>& started) {
  catch_stop_signals();
  Shared shared;
  std::thread thread([&] {
    NoController none;
    if (controller) {
      with_clock(io, rig, *controller, seconds, shared);
    } else {
      with_clock(io, rig, none, seconds, shared);
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
  {
    const Joiner joiner{shared, thread};
    bool told = false;
    LoopSample s;
    for (bool over = false; !over;) {
      over = shared.over;
      if (shared.ready && !told && started) started(shared.outcome), told = true;
      while (shared.queue.pop(s)) take(s);
      if (!over) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  LoopOutcome& out = shared.outcome;
  out.dropped_records = shared.queue.dropped();
  if (out.reason.empty()) {
    out.reason = out.trip == Fault::requested ? "stopped by a signal"
                 : out.trip != Fault::none    ? "trip: " + std::string(to_string(out.trip))
                 : rig.done()                 ? "the run is over"
                                              : "the time is over";
  }
  return out;
}

}  // namespace whirl::app
