#include "command.hpp"
#include "live_view.hpp"
#include "record_options.hpp"
#include "stop_signal.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/monitor/loop_columns.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::app {
namespace {

Recording read(const RecordOptions& options, const std::string& file) {
  if (io::file_format(file) != io::FileFormat::hdf5) return options.read(file);
  rt::LoopRecord record;
  try {
    record = rt::read_loop_record(file);
  } catch (const Error&) {
    return options.read(file);  // HDF5 of somebody else
  }
  return monitor::loop_recording(record, file);
}

}  // namespace

void add_monitor(CommandLine& app, Session& session) {
  struct Options {
    std::string file;
    double speed = 1;
    bool loop = false;
    RecordOptions record;
    ViewOptions view;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub =
      add_command(app, session, "monitor", "Play a record in a browser as if it were measured now",
                  "Input: a record with a time (CSV t_s,x_mm,y_mm,beta_rad, or another format) or a recording "
                  "of `whirl run --record`.\n"
                  "Serves one page on this machine alone: traces, orbit, spectra, waterfall, Bode and polar, phase "
                  "plane, limits, log; it needs\n"
                  "no network. Who has the printed address with its token can control; the address without it only "
                  "shows (docs/monitor.md).\n"
                  "A running loop is shown by `whirl run CONTROLLER --monitor`.\n\n"
                  "Example: whirl monitor rundown.csv --speed 0.5 --loop --limit x_mm=0.5 --record-folder records",
                  [o] {
                    catch_stop_signals();
                    Recording record = read(o->record, o->file);
                    monitor::HubOptions hub = o->view.hub(record.rate());
                    if (hub.read) {
                      hub.read = [columns = o->record](const std::filesystem::path& file) {
                        return read_opened(file, [&](const auto& path) { return read(columns, path.string()); });
                      };
                    }
                    if (!hub.reference && record.has("x_open") && record.has("beta"))
                      hub.reference = monitor::reference_of(record);
                    const Served served(
                        o->view, std::make_unique<monitor::PlaybackSource>(std::move(record), o->speed, o->loop), hub);
                    served.until_stopped();
                  });
  sub->add_option("FILE", o->file, "record to play")->input()->required();
  sub->add_option("--speed", o->speed, "times as fast as recorded, 0.01 to 10000")->range(0.01, 10000)->show_default();
  sub->add_flag("--loop", o->loop, "start again at the end");
  o->record.turning = true;
  o->record.add_to(sub);
  o->record.add_tacho_to(sub);
  o->view.add_to(sub);
}

}  // namespace whirl::app
