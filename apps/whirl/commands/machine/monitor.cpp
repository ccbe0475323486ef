#include "command.hpp"
#include "live_columns.hpp"
#include "live_view.hpp"
#include "record_options.hpp"
#include "stop_signal.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::app {
namespace {

/// A recording of a loop with the columns of the live view; ticks left out are gaps.
Recording loop_columns(const rt::LoopRecord& record, const std::string& file) {
  if (record.cycles.size() < 2) throw Error::in_file(file, 0, "holds no two cycles");
  const std::int64_t first = record.cycles.front().tick, last = record.cycles.back().tick;
  if (last <= first || last - first > 100'000'000) throw Error::in_file(file, 0, "ticks that do not ascend");
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  Eigen::MatrixXd table =
      Eigen::MatrixXd::Constant(last - first + 1, static_cast<Eigen::Index>(kLiveColumns.size()), kNaN);
  double previous = 0;
  for (const rt::LoopSample& s : record.cycles) {
    const LiveRow row = live_row(s, previous);
    previous = s.started;
    if (s.tick < first || s.tick > last) continue;
    table.row(s.tick - first) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), table.cols());
  }
  Recording out;
  out.dt = record.head.sample_time;
  out.source = file;
  for (std::size_t c = 0; c < kLiveColumns.size(); ++c) {
    out.add(std::string(kLiveColumns[c].first), kLiveColumns[c].second, table.col(static_cast<Eigen::Index>(c)));
  }
  return out;
}

Recording read(const RecordOptions& options, const std::string& file) {
  if (io::file_format(file) != io::FileFormat::hdf5) return options.read(file);
  rt::LoopRecord record;
  try {
    record = rt::read_loop_record(file);
  } catch (const Error&) {
    return options.read(file);  // HDF5 of somebody else
  }
  return loop_columns(record, file);
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
  o->record.add_to(sub);
  o->view.add_to(sub);
}

}  // namespace whirl::app
