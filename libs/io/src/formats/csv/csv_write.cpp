#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"

namespace whirl::io {
namespace {

struct Output {
  std::string header;
  const UnitSuffix* unit;
  const double* samples;  // null: time
};

const UnitSuffix* chosen_unit(std::string_view name, Quantity quantity, const CsvWriteOptions& options) {
  for (const std::string& wish : options.units) {
    const NameWithUnit w = split_unit(wish);
    if (!w.unit) throw Error("column " + unit_problem(wish));
    if (w.name != name) continue;
    const UnitSuffix* unit = find_unit(w.unit->suffix, quantity);
    if (!unit) {
      throw Error(
          fmt::format("{}: '{}' is a {}; allowed units: {}", wish, name, to_string(quantity), allowed_units(quantity)));
    }
    return unit;
  }
  return &si_suffix(quantity);
}

std::string csv_header(const std::vector<Output>& columns) {
  std::string text;
  for (const Output& c : columns) text += (&c == &columns.front() ? "" : ",") + c.header;
  return text + '\n';
}

/// `first`: rows of the record before these.
void write_rows(ByteSink& sink, const std::vector<Output>& columns, Eigen::Index rows, double t0, double dt,
                Eigen::Index first) {
  std::string text;
  char number[32];
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (const Output& c : columns) {
      if (&c != &columns.front()) text += ',';
      const double si = c.samples ? c.samples[i] : t0 + dt * static_cast<double>(first + i);
      if (!std::isnan(si)) text.append(number, std::to_chars(number, number + sizeof number, c.unit->from_si(si)).ptr);
    }
    text += '\n';
    if (text.size() > (1u << 16)) {
      sink.write(text);
      text.clear();
    }
  }
  sink.write(text);
}

std::vector<Output> columns_of(const std::filesystem::path& path, const std::vector<Channel>& channels, bool time,
                               const CsvWriteOptions& options) {
  std::vector<Output> columns;
  const auto add = [&](const std::string& name, Quantity quantity, const double* samples) {
    if (quantity == Quantity::dimensionless && (name.ends_with("_re") || name.ends_with("_im"))) {
      columns.push_back({name, &si_suffix(quantity), samples});
      return;
    }
    const UnitSuffix* unit = chosen_unit(name, quantity, options);
    columns.push_back({fmt::format("{}_{}", name, unit->suffix), unit, samples});
  };
  if (time) add("t", Quantity::time, nullptr);
  for (const Channel& c : channels) {
    if (c.name.empty() || c.name.find_first_of(",;\t\"\r\n#") != std::string::npos) {
      throw Error(fmt::format("{}: channel name '{}' cannot be written as a CSV header", path.string(), c.name));
    }
    if (c.samples.size() != channels.front().samples.size()) {
      throw Error(fmt::format("{}: channels '{}' and '{}' have {} and {} samples", path.string(), channels.front().name,
                              c.name, channels.front().samples.size(), c.samples.size()));
    }
    add(c.name, c.quantity, c.samples.data());
  }
  for (const std::string& wish : options.units) {
    if (std::none_of(columns.begin(), columns.end(), [&](const Output& c) { return c.header == wish; })) {
      throw Error(fmt::format("{}: no channel for the column '{}'", path.string(), wish));
    }
  }
  return columns;
}

void write_channels(const std::filesystem::path& path, const std::vector<Channel>& channels, bool time, double t0,
                    double dt, const CsvWriteOptions& options) {
  const std::vector<Output> columns = columns_of(path, channels, time, options);
  ByteSink sink(path);
  sink.write(csv_header(columns));
  write_rows(sink, columns, channels.empty() ? 0 : channels.front().samples.size(), t0, dt, 0);
  sink.close();
}

}  // namespace

void write_csv(const std::filesystem::path& path, const Recording& record, const CsvWriteOptions& options) {
  record.check();
  write_channels(path, record.channels, options.time, record.t0, record.dt, options);
}

void write_csv_with_gaps(const std::filesystem::path& path, const Recording& record) {
  write_channels(path, record.channels, true, record.t0, record.dt, {});
}

void write_csv(const std::filesystem::path& path, const Table& table, const CsvWriteOptions& options) {
  write_channels(path, table.columns, false, 0, 0, options);
}

void write_csv_parts(const std::filesystem::path& path, const Recording& first, RecordStream& rest, Eigen::Index) {
  Recording part = first;
  std::vector<Output> columns = columns_of(path, part.channels, true, {});
  const std::string header = csv_header(columns);
  ByteSink sink(path);
  sink.write(header);
  do {
    columns = columns_of(path, part.channels, true, {});
    if (csv_header(columns) != header) throw Error::in_file(part.source, 0, "its channels change inside the file");
    write_rows(sink, columns, part.size(), rest.start(), part.dt, rest.row() - part.size());
  } while (rest.next(part));
  sink.close();
}

}  // namespace whirl::io
