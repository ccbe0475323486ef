#include "record_options.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>

#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/record/channel_instants.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::app {
namespace {

constexpr Eigen::Index kPartRows = 1 << 18;  // at once, of a file that is read in parts

/// "FIRST:END"; `most`: rows of the record, in messages.
io::PartRows parse_rows(const std::string& rows, const std::string& most) {
  long first = 0, last = 0;
  int used = 0;
  if (std::sscanf(rows.c_str(), "%ld:%ld%n", &first, &last, &used) != 2 || used != static_cast<int>(rows.size()) ||
      first < 0 || last <= first)
    throw Error::in_field("--rows", rows, "FIRST:END with 0 <= FIRST < END" + most);
  return {first, last, kPartRows};
}

Recording part(const Recording& record, const std::string& text) {
  const std::string most = fmt::format(" <= {}", record.size());
  const io::PartRows rows = parse_rows(text, most);
  if (rows.end > record.size()) throw Error::in_field("--rows", text, "FIRST:END with 0 <= FIRST < END" + most);
  return identification::part_of(record, rows.first, rows.end - rows.first);
}

/// "CHANNEL", "CHANNEL:N" or "N".
std::pair<std::string, int> tacho_channel(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string tail = colon == std::string::npos ? text : text.substr(colon + 1);
  int number = 0;
  const auto [end, error] = std::from_chars(tail.data(), tail.data() + tail.size(), number);
  const bool whole = error == std::errc() && end == tail.data() + tail.size();
  if (!whole && colon == std::string::npos) return {text, 0};
  if (!whole || number < 1 || number > 10000)
    throw Error::in_field("--pulses", text, "CHANNEL, N or CHANNEL:N with N from 1 to 10000 pulses a turn");
  return {colon == std::string::npos ? "" : text.substr(0, colon), number};
}

}  // namespace

io::CsvOptions RecordOptions::csv() const {
  io::CsvOptions options;
  options.columns = columns;
  options.required = required;
  options.gaps = gaps;
  options.header_line = header_line;
  if (rate > 0) options.rate = rate;
  return options;
}

io::PartRows RecordOptions::part_rows() const {
  return rows.empty() ? io::PartRows{.each = kPartRows} : parse_rows(rows, "");
}

bool RecordOptions::in_parts(const std::string& file) const {
  const bool whole = tacho_stated() || !late.empty();
  if (whole && !stream && !rows.empty()) return false;  // the rows are read at once
  const bool parts = stream || io::is_large(file);
  if (parts && whole)
    throw Error(file +
                ": it is read in parts, and --pulses, --missing, --edge and --late need the whole: convert it first, "
                "or state --rows without --stream");
  return parts;
}

void RecordOptions::require_uses(const std::string& file) const {
  if (header_line > 0 && io::file_format(file) != io::FileFormat::csv)
    throw Error(file + ": --header-line is for CSV files; this one states the names of its channels: leave it out");
}

Recording RecordOptions::read(const std::string& file) const {
  require_uses(file);
  const bool some = !rows.empty() && io::is_large(file);
  Recording record = some ? io::read_record_rows(file, csv(), part_rows()) : io::read_recording(file, csv());
  if (!rows.empty() && !some) record = part(record, rows);
  for (const std::string& text : late)
    record = identification::at_common_instants(std::move(record), identification::late_channel(text));
  return with_angle(std::move(record));
}

Recording RecordOptions::with_angle(Recording record) const {
  if (tacho_stated()) {
    const auto [channel, number] = tacho_channel(pulses);
    using enum signal::Edge;
    const signal::Edge chosen = edge == "rising"    ? rising
                                : edge == "falling" ? falling
                                : edge == "both"    ? both
                                                    : automatic;
    return identification::with_angle_from_pulses(record, channel, {number, missing, chosen});
  }
  if (!turning || record.has("beta")) return record;
  try {
    const Recording told = identification::with_angle_from_pulses(record, "");
    if (const Channel* beta = told.find("beta")) record.add("beta", Quantity::angle, beta->samples);
  } catch (const Error& e) {
    const std::string what = e.what(), head = record.source + ": ";
    io::remark(record.source, what.starts_with(head) ? what.substr(head.size()) : what);
  }
  return record;
}

void RecordOptions::add_tacho_to(CommandLine* sub) {
  sub->add_option("--pulses", pulses,
                  "the tacho that gives the angle: CHANNEL, pulses a turn N, or CHANNEL:N; default key, keyphasor or "
                  "tacho, and the number that its pattern shows");
  sub->add_option("--missing", missing,
                  "places of the N a turn without a pulse (a 36-1 wheel: --pulses 36 --missing 1)")
      ->range(0, 100);
  sub->add_option("--edge", edge, "of the pulses: rising, falling or both; default the leading one")
      ->one_of({"rising", "falling", "both"});
}

void RecordOptions::add_rows_to(CommandLine* sub) {
  sub->add_option("--rows", rows, "use rows FIRST:END of the record only (from 0, END not included)");
}

void RecordOptions::add_stream_to(CommandLine* sub) {
  sub->add_flag("--stream", stream, "read the file in parts, in bounded memory; so is every file above 1 GiB");
}

void RecordOptions::add_to(CommandLine* sub, bool part) {
  sub->add_option("--columns", columns,
                  "columns to read, HEADER or HEADER:name_unit, with a calibration *FACTOR, e.g. V1:x_mm*0.125");
  sub->add_option("--rate", rate, "sample rate in Hz, for files without a time column")->range(1e-9, 1e12);
  sub->add_option("--header-line", header_line, "CSV: line of the column names, where lines about the test come before")
      ->range(1, 10000);
  if (!part) return;
  add_rows_to(sub);
  sub->add_option("--late", late,
                  "a channel read SECONDS after the others, CHANNEL=SECONDS: it is brought to their instants");
}

}  // namespace whirl::app
