#include "whirl/hardware/virtual_run.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include "whirl/control/controller.hpp"
#include "whirl/hardware/loop_samples.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::hardware {
namespace {

/// What both threads know.
struct VirtualRunState {
  rt::RecordQueue<rt::LoopSample> queue{1 << 14};
  std::atomic<bool> over{false}, abandon{false};
  rt::LoopTiming timing;
};

/// The virtual machine takes one tick a cycle and stands still while the computer is late: no tick of it is left out,
/// whatever the grid of the wall clock lost (LoopTiming::missed). The loop that was told otherwise would trip on a gap,
/// or divide a motion of one tick by the time of many.
struct MachineClock : rt::PacedClock<rt::WallTime> {
  using PacedClock::PacedClock;
  long wait() noexcept {
    PacedClock::wait();
    return 0;
  }
};

void cycles(const std::shared_ptr<const rig::RigTables>& tables, control::Controller& controller, double rate,
            const VirtualRunOptions& options, rt::LoopControl& control, VirtualRunState& shared) {
  std::uint64_t seed = options.seed;
  rig::VirtualRig rig(tables, {seed, {}});
  rt::WallTime time;
  rt::PaceOptions pace;
  pace.period = std::llround(1e9 / rate);
  rt::ControlledClock<MachineClock> clock(control, time, pace);
  rt::ControlledLaw law(controller, control);
  rt::Loop loop(rig, law, clock);
  for (long tick = 0; !options.stop() && !shared.abandon; ++tick) {
    control.apply(loop, [&]() noexcept { controller.reset(); });
    const rt::CycleRecord r = loop.cycle();
    rt::LoopSample s = sample_of(r, clock.scheduled(), clock.started());
    add_internals(s, controller);
    s.tick = tick;
    shared.queue.push(s);
    if (!rig.done()) continue;
    if (!options.repeat) break;
    rig.restart(++seed);
    controller.reset();
  }
  shared.timing = clock.timing();
}

}  // namespace

Recording virtual_open_loop(const rig::RigParameters& parameters, std::uint64_t seed) {
  rig::VirtualRig rig(rig::make_rig_tables(parameters), {seed, {}});
  Eigen::MatrixXd table(rig.ticks(), 3);
  for (Eigen::Index k = 0; k < table.rows(); ++k, rig.advance()) {
    const Measurement m = rig.read();
    table.row(k) << m.x, m.y, m.beta;
  }
  Recording out;
  out.dt = 1 / parameters.timing.rate;
  out.source = "open loop (simulated)";
  out.add("x", Quantity::displacement, table.col(0));
  out.add("y", Quantity::displacement, table.col(1));
  out.add("beta", Quantity::angle, table.col(2));
  return out;
}

VirtualRun run_virtual(const ControllerDesign& design, const rig::RigParameters& rig,
                       const VirtualRunOptions& options) {
  control::Controller controller = control::make_controller(design);
  const auto tables = rig::make_rig_tables(rig);
  rt::LoopControl nobody;
  VirtualRunState shared;
  {
    std::jthread thread([&] {
      cycles(tables, controller, rig.timing.rate, options, options.control ? *options.control : nobody, shared);
      shared.over = true;
    });
    // Whatever happens here, the loop comes to its end.
    struct Abandon {
      std::atomic<bool>& flag;
      ~Abandon() { flag = true; }
    } const abandon{shared.abandon};
    rt::LoopSample s;
    for (bool over = false; !over;) {
      over = shared.over;
      while (shared.queue.pop(s)) {
        if (options.take) options.take(s);
      }
      if (!over) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  return {shared.timing, shared.queue.dropped(), options.stop() ? "stopped by a signal" : "the run is over"};
}

io::Json to_json(const VirtualRun& run) {
  io::Json json = io::start_document("whirl.live", 1);
  json.set("reason", run.reason).set("cycles", run.timing.executed).set("missed", run.timing.missed);
  json.set("latency_p99", run.timing.latency.quantile(0.99)).set("latency_max", run.timing.latency.max());
  return json.set("records_dropped", static_cast<double>(run.dropped_records));
}

}  // namespace whirl::hardware
