#include "record_options.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/record/channel_instants.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::app {
namespace {

/// Rows "FIRST:END" of a record.
Recording part(const Recording& record, const std::string& rows) {
  long first = 0, last = 0;
  int used = 0;
  if (std::sscanf(rows.c_str(), "%ld:%ld%n", &first, &last, &used) != 2 || used != static_cast<int>(rows.size()) ||
      first < 0 || last <= first || last > record.size()) {
    throw Error::in_field("--rows", rows, fmt::format("FIRST:END with 0 <= FIRST < END <= {}", record.size()));
  }
  return identification::part_of(record, first, last - first);
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

Recording RecordOptions::read(const std::string& file) const {
  Recording record = io::read_recording(file, csv());
  if (!rows.empty()) record = part(record, rows);
  for (const std::string& text : late)
    record = identification::at_common_instants(std::move(record), identification::late_channel(text));
  return record;
}

void RecordOptions::add_to(CommandLine* sub, bool part) {
  sub->add_option("--columns", columns,
                  "columns to read, HEADER or HEADER:name_unit, with a calibration *FACTOR, e.g. V1:x_mm*0.125");
  sub->add_option("--rate", rate, "sample rate in Hz, for files without a time column")->range(1e-9, 1e12);
  sub->add_option("--header-line", header_line, "CSV: line of the column names, where lines about the test come before")
      ->range(1, 10000);
  if (!part) return;
  sub->add_option("--rows", rows, "use rows FIRST:END of the record only (from 0, END not included)");
  sub->add_option("--late", late,
                  "a channel read SECONDS after the others, CHANNEL=SECONDS: it is brought to their instants");
}

}  // namespace whirl::app
