#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/pages/file_report.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::app {
namespace {

/// The recording of a loop that this file is, whole or of a writer that was killed; none for any other file.
std::optional<rt::LoopRecord> loop_record(const std::filesystem::path& file) {
  if (file.extension() != ".h5" && file.extension() != ".hdf5") return std::nullopt;
  try {
    return rt::read_loop_record(file);
  } catch (const Error&) {
    return std::nullopt;
  }
}

void tell(const rt::LoopRecord& record, const std::string& file, Session& session) {
  const double h = record.head.sample_time;
  std::array<double, 4> peak{};  // x, y, ux, uy
  std::int64_t armed = 0, left_out = 0;
  Fault trip = Fault::none;
  for (const rt::LoopSample& s : record.cycles) {
    const double values[] = {s.x, s.y, s.ux, s.uy};
    for (std::size_t i = 0; i < 4; ++i) peak[i] = std::max(peak[i], std::isfinite(values[i]) ? std::abs(values[i]) : 0);
    armed += (s.flags & rt::kArmed) != 0;
    left_out += s.missed;
    if (trip == Fault::none) trip = static_cast<Fault>(s.trip);
  }
  session.say(fmt::format("{}: recording of a loop, {} at {:g} Hz ({:.2f} s), {} armed, {} left out, trip: {}", file,
                          counted(record.cycles.size(), "cycle"), 1 / h, h * static_cast<double>(record.cycles.size()),
                          armed, counted(left_out, "tick"), to_string(trip)));
  session.say(fmt::format("peak x {:.4g} mm, y {:.4g} mm, force {:.4g} N and {:.4g} N (zero-to-peak)", 1e3 * peak[0],
                          1e3 * peak[1], peak[2], peak[3]));
  for (const rt::LoopEvent& e : record.events) session.say(fmt::format("  tick {}: {}", e.tick, e.text));
  io::Json events = io::Json::array();
  for (const rt::LoopEvent& e : record.events)
    events.push(io::Json::object().set("tick", static_cast<double>(e.tick)).set("t", e.t).set("text", e.text));
  session.result(io::start_document("whirl.loop-info", 1)
                     .set("cycles", static_cast<double>(record.cycles.size()))
                     .set("sample_time", h)
                     .set("closed", record.closed)
                     .set("armed", static_cast<double>(armed))
                     .set("missed", static_cast<double>(left_out))
                     .set("trip", std::string(to_string(trip)))
                     .set("x_peak", peak[0])
                     .set("y_peak", peak[1])
                     .set("ux_peak", peak[2])
                     .set("uy_peak", peak[3])
                     .set("events", std::move(events)));
  Summary summary;
  if (!record.closed) {
    summary.warn(
        file +
        ": its writer did not come to its end, or is at work; what it has flushed, twice a second, is here and "
        "`whirl replay` reads it");
  }
  session.finish(summary);
}

/// The channels that are asked for of a file that is no CSV table, whose reader takes them itself.
io::SignalFile chosen(io::SignalFile file, const RecordOptions& options) {
  if ((options.columns.empty() && options.rate <= 0) || file.tables.empty()) return file;
  const Recording record = io::recording_of(file, options.csv());
  io::SignalTable table{.name = file.tables.front().name, .start = record.t0, .step = record.dt};
  table.abscissa = Quantity::time;
  for (const Channel& c : record.channels) {
    io::Signal signal;
    signal.name = c.name;
    signal.unit = si_unit(c.quantity);
    signal.quantity = c.quantity;
    signal.value = c.samples;
    table.signals.push_back(std::move(signal));
  }
  file.tables = {std::move(table)};
  return file;
}

/// Of a file in parts without its rows stated: what can be told without all values at once.
pages::FileReport report_of(const RecordOptions& options, const std::string& file, Session& session) {
  options.require_uses(file);
  const bool parts = options.in_parts(file), table = io::file_format(file) == io::FileFormat::csv;
  const auto report = [&](io::SignalFile signals) {
    std::function<Recording(const Recording&)> turn;
    if (options.tacho_stated()) turn = [&](const Recording& record) { return options.with_angle(record); };
    return pages::report_file(table ? std::move(signals) : chosen(std::move(signals), options), turn);
  };
  if (!options.rows.empty()) return report(io::read_signal_rows(file, options.csv(), options.part_rows()));
  if (!parts) return report(io::read_signals(file, options.csv()));
  if (!table && (!options.columns.empty() || options.rate > 0))
    throw Error(file + ": --columns and --rate choose from the whole of such a file: state --rows, or leave them out");
  const std::unique_ptr<io::SignalStream> stream = io::open_signal_stream(file, options.csv(), options.part_rows());
  return pages::report_of(io::describe(*stream, [&](double share) { session.progress("info", share); }));
}

}  // namespace

void add_info(CommandLine& app, Session& session) {
  struct Options {
    std::string file;
    RecordOptions record;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "info", "What a file holds: channels, units, rate, duration, and what looks suspicious",
      "Input: " + io::readable_formats() +
          ", found from the content; text may be .gz.\n"
          "A recording of a loop is summed up, also when its writer was killed.\n"
          "CSV names its columns with units (x_mm, or x [mm]), a universal file datasets 58, 58b, 55, 15, 82, ...\n\n"
          "Example: whirl info rundown.csv",
      [o, &session] {
        if (const auto record = loop_record(o->file)) {
          if (o->record.any_stated())
            throw Error(o->file +
                        ": a recording of a loop states its own channels, rate and angle: leave the flags out");
          tell(*record, o->file, session);
          return;
        }
        o->record.gaps = true;
        const pages::FileReport report = report_of(o->record, o->file, session);
        session.say(pages::to_text(report));
        session.result(pages::to_json(report));
      });
  sub->add_option("FILE", o->file, "file of any of these formats")->input()->required();
  o->record.add_to(sub, false);
  o->record.add_rows_to(sub);
  o->record.add_stream_to(sub);
  o->record.add_tacho_to(sub);
}

}  // namespace whirl::app
