// CSV in the catalogue: what no other format knows is taken for it.
#include <fmt/format.h>

#include <algorithm>

#include "formats/csv/csv_header.hpp"
#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/frf_csv.hpp"

namespace whirl::io {

std::string to_string(const CsvDialect& d) {
  std::string out = d.delimiter == '\t' ? "tab" : fmt::format("'{}'", d.delimiter);
  out += fmt::format(" between values, decimal '{}'", d.decimal);
  if (d.trailing_delimiter) out += ", delimiter at line ends";
  if (d.byte_order_mark) out += ", byte order mark";
  if (d.carriage_return) out += ", CR LF";
  if (d.compressed) out += ", gzip";
  return out;
}

namespace {

/// The names that commands of rotors need, where a file has displacements and none is called x or y; else empty.
std::string proposed_names(const std::vector<CsvColumn>& columns) {
  bool moves = false;
  std::vector<detail::Heading> headings;
  for (const CsvColumn& c : columns) {
    if (c.name == "x" || c.name == "y") return "";
    moves = moves || c.unit->quantity == Quantity::displacement;
    headings.push_back(detail::parse_heading(c.header));
    headings.back().name = c.name;
    headings.back().unit = c.unit;
  }
  if (!moves) return "";
  return "no channel is called x or y; where they are the displacements of a rotor: --columns " +
         detail::proposed_columns(headings, false, {"x_mm", "y_mm", "beta_rad"});
}

SignalFile signals_from_csv(const std::filesystem::path& path, const CsvOptions& options) {
  SignalFile file;
  CsvDialect dialect;
  const CsvStream head(path, options);
  const bool timed = options.rate.has_value() || head.time_column() >= 0;
  SignalTable table;
  std::vector<Channel> channels;
  if (timed) {
    Recording recording = read_csv(path, options, &dialect);
    table.abscissa = Quantity::time;
    table.start = recording.t0;
    table.step = recording.dt;
    channels = std::move(recording.channels);
    file.format = to_string(dialect);
    if (std::string names = proposed_names(head.columns()); options.columns.empty() && !names.empty())
      file.findings.push_back(std::move(names));
  } else {
    channels = read_table(path, options).columns;
    file.format = "CSV table";
    if (!channels.empty() && channels.front().name == "freq" && channels.front().quantity == Quantity::frequency) {
      set_abscissa(table, Quantity::frequency, channels.front().samples);
      channels.erase(channels.begin());
    }
  }
  for (Channel& channel : channels) {
    table.signals.push_back(
        {channel.name, std::string(si_unit(channel.quantity)), channel.quantity, std::move(channel.samples), {}});
  }
  file.source = path.string();
  file.tables.push_back(std::move(table));
  return file;
}

std::optional<FrequencyResponse> responses_from_csv(const std::filesystem::path& path, const ResponseOptions& options) {
  const CsvStream stream(path);
  const bool spectra = std::any_of(stream.columns().begin(), stream.columns().end(), [](const CsvColumn& c) {
    return is_frequency_axis({c.name, c.unit->quantity, {}});
  });
  if (!spectra) return {};
  if (!options.kind)
    throw Error::in_file(path.string(), 1,
                         "a table of frequency responses does not say what was measured: state --kind");
  return read_frf_csv(path, *options.kind);
}

}  // namespace

Format csv_format() {
  Format f{FileFormat::csv, "CSV", {".csv", ".txt", ".tsv"}, [](std::string_view) { return true; }};
  f.read = signals_from_csv;
  f.write = write_csv_with_gaps;
  f.missing = "an empty cell";
  f.write_parts = write_csv_parts;
  f.read_responses = responses_from_csv;
  f.write_responses = write_frf_csv;
  f.stream = stream_csv;
  return f;
}

}  // namespace whirl::io
