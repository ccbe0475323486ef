#include "run_live.hpp"

#include <fmt/format.h>

#include "stop_signal.hpp"
#include "whirl/hardware/virtual_run.hpp"

namespace whirl::app {

void run_live(Session& session, const ControllerDesign& design, const rig::RigParameters& rig,
              const RunLiveOptions& options) {
  const double rate = rig.timing.rate;
  catch_stop_signals();
  LiveView view(options.view, {design.law + " on the simulated rig", rate, design.force_limit},
                monitor::reference_of(hardware::virtual_open_loop(rig, options.seed)));
  hardware::VirtualRunOptions run_options;
  run_options.seed = options.seed;
  run_options.repeat = options.repeat;
  run_options.take = [&](const rt::LoopSample& s) { view.take(s); };
  run_options.control = view.control();
  run_options.stop = stop_requested;
  const hardware::VirtualRun run = hardware::run_virtual(design, rig, run_options);
  view.ended(run.reason);
  const rt::LoopTiming& t = run.timing;
  session.say(fmt::format(
      "{} with {} on the simulated rig in real time, {:g} Hz: {}; {} cycles, {} ticks left out, wake-up latency "
      "{:.0f} us p99, {:.0f} us at most; {} samples lost to the view",
      design.law, design.estimator, rate, run.reason, t.executed, t.missed, 1e6 * t.latency.quantile(0.99),
      1e6 * t.latency.max(), run.dropped_records));
  session.result(hardware::to_json(run));
  std::fflush(stdout);
  view.until_stopped();
}

}  // namespace whirl::app
