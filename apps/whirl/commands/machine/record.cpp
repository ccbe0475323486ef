#include <fmt/format.h>

#include "run_io.hpp"
#include "stop_signal.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/hardware/realtime_run.hpp"
#include "whirl/hardware/replay.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::app {
namespace {

void replay(Session& session, const std::string& file, const std::string& controller_file, const std::string& estimator,
            const std::string& out) {
  const rt::LoopRecord record = rt::read_loop_record(file);
  session.say(fmt::format("{}: {} at {:g} Hz{}", file, counted(record.cycles.size(), "cycle"),
                          1 / record.head.sample_time, record.closed ? "" : "; its writer was killed"));
  for (const rt::LoopEvent& e : record.events) session.say(fmt::format("  tick {}: {}", e.tick, e.text));
  const ControllerDesign design = hardware::with_estimator(
      controller_file.empty() ? hardware::recorded_design(record) : io::load<ControllerDesign>(controller_file),
      estimator);
  const hardware::Replay result = hardware::replay(record, design, file);
  session.say(fmt::format("{} with {}: force differs from the recorded one by {:.3g} N rms, {:.3g} N at most, over {}",
                          design.law, design.estimator, result.force_rms, result.force_worst,
                          counted(result.compared, "cycle")));
  if (!out.empty()) io::write_csv(out, result.log);
  session.result(hardware::to_json(result));
}

}  // namespace

void add_record(CommandLine& app, Session& session) {
  struct Options {
    std::string io, out;
    double seconds = 0;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "record", "Record sensors and rotor angle without control",
      "Input: io.toml (docs/formats.md). Output: HDF5 with one row per tick (dataset `cycles`, SI) and events; it can "
      "be read\n"
      "at any time, also after a kill, and lacks half a second at most. Ends after --seconds, with the rig, or on "
      "Ctrl-C.\n\n"
      "Example: whirl record --io io.toml --seconds 20 --out rundown.h5 && whirl replay rundown.h5 --controller c.json",
      [o, &session] {
        const hardware::IoSettings io = hardware::read_io(o->io);
        catch_stop_signals();
        hardware::RealtimeRunOptions options;
        options.seconds = o->seconds;
        options.record = o->out;
        options.texts = {{"settings", io::read_text(o->io)}, {"command_line", session.command_line}};
        options.stop = stop_requested;
        options.note = [](const std::string& line) { tell("whirl: {}\n", line); };
        const hardware::RecordRun run = hardware::record_disarmed(io, options);
        for (const std::string& text : run.angle) session.say(text);
        session.say(fmt::format("{}: {}, {} left out, {} dropped; {}", o->out, counted(run.cycles, "cycle"),
                                counted(run.loop.timing.missed, "tick"), counted(run.loop.dropped_records, "record"),
                                run.loop.reason));
        session.result(hardware::to_json(run));
        session.finish(run.summary);
        if (!run.record_error.empty()) {
          throw Error::in_file(o->out, 0,
                               fmt::format("the recording is not complete, {} cycles are missing: {}", run.not_recorded,
                                           run.record_error));
        }
      });
  sub->add_option("--io", o->io, "settings of sensors, board and loop (TOML)")->input()->required();
  sub->add_option("--out", o->out, "recording to write (.h5)")->output("HDF5")->required();
  sub->add_option("--seconds", o->seconds, "end after so long; 0: when the rig is done or a signal comes")
      ->range(0, 1e6);
}

void add_replay(CommandLine& app, Session& session) {
  struct Options {
    std::string file, controller, estimator, out;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub =
      add_command(app, session, "replay", "A recording of a loop through a controller or estimator",
                  "Input: recording of `whirl run --record` or `whirl record`. The controller (default: the one "
                  "recorded) gets the\n"
                  "recorded samples and the forces that were really sent; --estimator replaces its estimator.\n"
                  "Output: difference to the recorded force; --out writes both, the estimates and the sliding "
                  "variables as CSV (SI).\n\n"
                  "Example: whirl replay run.h5 --estimator kalman --out replay.csv",
                  [o, &session] { replay(session, o->file, o->controller, o->estimator, o->out); });
  sub->add_option("RECORDING", o->file, "recording (.h5)")->input()->required();
  sub->add_option("--controller", o->controller, "controller.json")->input();
  sub->add_option("--estimator", o->estimator, "estimator; `whirl design --list` names all");
  sub->add_option("--out", o->out, "CSV file to write")->output("record");
}

}  // namespace whirl::app
