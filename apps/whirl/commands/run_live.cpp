#include "run_live.hpp"

#include <atomic>
#include <cmath>
#include <thread>

#include "loop_samples.hpp"
#include "stop_signal.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/rt/record_queue.hpp"

namespace whirl::app {
namespace {

/// What the sensors show without control.
Recording open_loop(const std::shared_ptr<const rig::RigTables>& tables, double rate, std::uint64_t seed) {
  rig::VirtualRig rig(tables, {seed, {}});
  Eigen::MatrixXd table(rig.ticks(), 3);
  for (Eigen::Index k = 0; k < table.rows(); ++k, rig.advance()) {
    const Measurement m = rig.read();
    table.row(k) << m.x, m.y, m.beta;
  }
  Recording out;
  out.dt = 1 / rate;
  out.source = "open loop (simulated)";
  out.add("x", Quantity::displacement, table.col(0));
  out.add("y", Quantity::displacement, table.col(1));
  out.add("beta", Quantity::angle, table.col(2));
  return out;
}

/// What both threads know.
struct Shared {
  rt::RecordQueue<rt::LoopSample> queue{1 << 14};
  std::atomic<bool> over{false}, abandon{false};
  rt::LoopTiming timing;
};

void cycles(const std::shared_ptr<const rig::RigTables>& tables, control::Controller& controller, double rate,
            const RunLiveOptions& options, rt::LoopControl& control, Shared& shared) {
  std::uint64_t seed = options.seed;
  rig::VirtualRig rig(tables, {seed, {}});
  rt::WallTime time;
  rt::PaceOptions pace;
  pace.period = std::llround(1e9 / rate);
  rt::ControlledClock<rt::PacedClock<rt::WallTime>> clock(control, time, pace);
  rt::ControlledLaw law(controller, control);
  rt::Loop loop(rig, law, clock);
  for (long tick = 0; stop_signal() == 0 && !shared.abandon; ++tick) {
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

void run_live(Session& session, const ControllerDesign& design, const rig::RigParameters& rig,
              const RunLiveOptions& options) {
  control::Controller controller = control::make_controller(design);
  const auto tables = rig::make_rig_tables(rig);
  const double rate = rig.timing.rate;
  catch_stop_signals();
  rt::LoopControl nobody;
  Shared shared;
  LiveView view(options.view, {design.law + " on the virtual rig", rate, design.force_limit,
                               monitor::reference_of(open_loop(tables, rate, options.seed))});
  rt::LoopControl* control = view.control() ? view.control() : &nobody;
  {
    std::jthread thread([&] {
      cycles(tables, controller, rate, options, *control, shared);
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
      while (shared.queue.pop(s)) view.take(s);
      if (!over) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  const std::string reason = stop_signal() != 0 ? "stopped by a signal" : "the run is over";
  view.ended(reason);
  const rt::LoopTiming& t = shared.timing;
  session.say(fmt::format(
      "{} with {} on the virtual rig in real time, {:g} Hz: {}; {} cycles, {} ticks left out, wake-up latency "
      "{:.0f} us p99, {:.0f} us at most; {} samples lost to the view",
      design.law, design.estimator, rate, reason, t.executed, t.missed, 1e6 * t.latency.quantile(0.99),
      1e6 * t.latency.max(), shared.queue.dropped()));
  io::Json json = io::start_document("whirl.live", 1);
  json.set("reason", reason).set("cycles", t.executed).set("missed", t.missed);
  json.set("latency_p99", t.latency.quantile(0.99)).set("latency_max", t.latency.max());
  json.set("records_dropped", static_cast<double>(shared.queue.dropped()));
  session.result(json);
  std::fflush(stdout);
  view.until_stopped();
}

}  // namespace whirl::app
