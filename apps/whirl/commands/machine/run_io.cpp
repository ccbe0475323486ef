#include "run_io.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "stop_signal.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/hardware/realtime_run.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

constexpr double kMicro = 1e6;

report::Table timing_table(const rt::LoopTiming& t) {
  report::Table table;
  table.caption = "Timing, us";
  table.columns = {{"", "", report::Align::left},
                   {"p50", ""},
                   {"p90", ""},
                   {"p99", ""},
                   {"p99.9", ""},
                   {"max", ""},
                   {"at tick", ""}};
  const auto add = [&](const char* name, const rt::Histogram& h) {
    if (h.total() == 0) return;
    std::vector<std::string> row{name};
    for (const double q : {0.5, 0.9, 0.99, 0.999}) row.push_back(fmt::format("{:.1f}", kMicro * h.quantile(q)));
    row.push_back(fmt::format("{:.1f}", kMicro * h.max()));
    row.push_back(fmt::format("{}", h.worst()));
    table.add(row);
  };
  add("wake-up latency", t.latency);
  add("execution", t.execution);
  add("period", t.period);
  return table;
}

// One line per octave that holds something.
std::string bars(const char* name, const rt::Histogram& h) {
  std::string text;
  for (int octave = 0; octave < 40 && h.total() > 0; ++octave) {
    const std::uint64_t n = h.in_octave(octave);
    if (n == 0) continue;
    const double share = static_cast<double>(n) / static_cast<double>(h.total());
    text += fmt::format("{:>10} {:>10.1f} us {:>8} {}\n", name, 1e-3 * std::ldexp(1.0, octave + 1), n,
                        std::string(static_cast<std::size_t>(std::ceil(50 * share)), '#'));
    name = "";
  }
  return text;
}

}  // namespace

void RunIoOptions::add_to(CommandLine* sub) {
  sub->add_option("--io", io,
                  "run on hardware, or on `whirl rig serve`: settings of sensors, board, loop and safety (TOML)")
      ->input();
  sub->add_option("--record", record, "with --io: HDF5 recording of every cycle; readable also after a kill")
      ->output("HDF5")
      ->needs("--io");
  sub->add_option("--seconds", seconds, "with --io: end after so long; 0: when the rig is done or a signal comes")
      ->range(0, 1e6)
      ->needs("--io");
  sub->add_flag("--require-rt", require_rt, "with --io: refuse to run when the system refuses a real-time property")
      ->needs("--io");
}

void run_io(Session& session, const std::string& controller_file, const RunIoOptions& o,
            const ViewOptions* view_options) {
  const ControllerDesign design = io::load<ControllerDesign>(controller_file);
  const hardware::IoSettings io = hardware::read_io(o.io);
  std::optional<LiveView> view;
  if (view_options)
    view.emplace(*view_options, LiveView::About{design.law + " on hardware", io.rate, design.force_limit});
  catch_stop_signals();
  hardware::RealtimeRunOptions options;
  options.seconds = o.seconds;
  options.require_realtime = o.require_rt;
  options.record = o.record;
  options.texts = {{"controller", io::read_text(controller_file)},
                   {"settings", io::read_text(o.io)},
                   {"command_line", session.command_line}};
  options.started = [](const hardware::LoopOutcome& at_start) {
    for (const std::string& text : at_start.refused) tell("whirl: real time: {}\n", text);
  };
  if (view) {
    options.take = [&](const rt::LoopSample& s) { view->take(s); };
    options.control = view->control();
  }
  options.stop = stop_requested;
  options.note = [&](const std::string& line) {
    tell("whirl: {}: {}\n", o.record, line);
    if (view) view->note(line);
  };
  const hardware::RealtimeRun run = hardware::run_realtime(design, io, options);
  const hardware::LoopOutcome& out = run.loop;
  for (const std::string& text : run.angle) session.say(text);
  if (run.tacho_missing >= 0)
    session.say(fmt::format("tacho: {} pulses lost, {} added ones left out", run.tacho_missing, run.tacho_extra));
  if (view) {
    view->ended(out.reason);
    view->until_stopped();
  }

  const rt::LoopTiming& t = out.timing;
  session.say(fmt::format("{} with {}, {} clock, {:g} Hz, dt policy {}, overrun policy {}: {}", design.law,
                          design.estimator, io.clock, io.rate, io.dt, io.overrun, out.reason));
  if (out.trip != Fault::none) {
    session.say(fmt::format("safe output from tick {} on; x {}, y {}", out.trip_tick, to_string(out.inputs[0]),
                            to_string(out.inputs[1])));
  }
  session.say(fmt::format(
      "measured peak x {:.4f} mm, y {:.4f} mm (zero-to-peak); force x {:.2f} and y {:.2f} N rms, {:.1f} N peak; {} of "
      "{} "
      "samples lost, {:.2f} % of ticks limited",
      1e3 * run.x_peak, 1e3 * run.y_peak, run.force_rms, run.force_y_rms, run.force_peak, run.lost, run.samples,
      run.samples > 0 ? 100.0 * static_cast<double>(run.saturated) / static_cast<double>(run.samples) : 0));
  session.say(report::to_text(timing_table(t)));
  session.say(bars("latency", t.latency) + bars("execution", t.execution) + bars("period", t.period));
  session.say(fmt::format(
      "{} cycles, {} ticks left out ({} times by a cycle that took too long, {} by a late wake-up, {} by samples "
      "that came late or not at all); {} records dropped",
      t.executed, t.missed, t.late_work, t.late_wake, t.late_source, out.dropped_records));
  for (std::size_t i = 0; i < 2; ++i) {
    const hardware::LaserReport& laser = run.lasers[i];
    if (!laser.present) continue;
    session.say(fmt::format("laser {}: {} frames, {} lost, {} bytes dropped, {} ticks without a new sample",
                            i == 0 ? "x" : "y", laser.frames, laser.frames_lost, laser.bytes_dropped, laser.late));
  }
  session.result(hardware::to_json(run));
  session.finish(run.summary);
  if (!run.record_error.empty()) {
    throw Error::in_file(o.record, 0,
                         fmt::format("the recording is not complete, {} of {} cycles are missing: {}", run.not_recorded,
                                     run.samples, run.record_error));
  }
}

}  // namespace whirl::app
