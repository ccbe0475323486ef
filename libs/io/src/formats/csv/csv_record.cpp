#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "formats/csv/csv_gaps.hpp"
#include "formats/csv/csv_rates.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/remarks.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kBlockValues = std::size_t{1} << 17;

/// All columns of a stream. Blocks are kept per column and joined one column at a time, so that the peak is
/// the numeric size plus one column.
std::vector<Channel> read_columns(CsvStream& stream, Eigen::Index min_samples) {
  const std::size_t n = stream.columns().size();
  std::vector<std::vector<Eigen::VectorXd>> parts(n);
  Eigen::MatrixXd block(static_cast<Eigen::Index>(std::max(kBlockValues / n, std::size_t{16})),
                        static_cast<Eigen::Index>(n));
  Eigen::Index total = 0;
  while (const Eigen::Index rows = stream.next(block)) {
    for (std::size_t c = 0; c < n; ++c) parts[c].emplace_back(block.col(static_cast<Eigen::Index>(c)).head(rows));
    total += rows;
  }
  if (total == 0) throw Error::in_file(stream.source(), 0, "has a header and no data: export the readings with it");
  if (total < min_samples) {
    throw Error::in_file(stream.source(), 0,
                         fmt::format("{}; at least {} are needed", counted(total, "sample"), min_samples));
  }
  std::vector<Channel> out;
  for (std::size_t c = 0; c < n; ++c) {
    const CsvColumn& column = stream.columns()[c];
    Eigen::VectorXd samples;
    if (parts[c].size() == 1) {
      samples = std::move(parts[c].front());
    } else {
      samples.resize(total);
      Eigen::Index at = 0;
      for (Eigen::VectorXd& part : parts[c]) {
        samples.segment(at, part.size()) = part;
        at += part.size();
        part = Eigen::VectorXd();
      }
    }
    out.push_back({column.name, column.unit->quantity, std::move(samples)});
  }
  return out;
}

double round_digits(double value, int digits) { return std::stod(fmt::format("{:.{}e}", value, digits - 1)); }

/// The step, or the inverse of the rate, with the fewest digits that agrees with `dt` within `tolerance`;
/// `dt` itself when none has at most 12 digits.
double simplest_step(double dt, double tolerance) {
  for (int digits = 1; digits <= 12; ++digits) {
    const double step = round_digits(dt, digits);
    if (std::abs(step - dt) <= tolerance) return step;
    const double rate = round_digits(1 / dt, digits);
    if (std::abs(1 / rate - dt) <= tolerance) return 1 / rate;
  }
  return dt;
}

}  // namespace

detail::CsvGrid detail::csv_grid(const CsvStream& stream, double first, double last, Eigen::Index n, double digits,
                                 bool stated) {
  const UnitSuffix& unit = *stream.columns()[static_cast<std::size_t>(stream.time_column())].unit;
  const double steps = static_cast<double>(n - 1), mean_step = (last - first) / steps;
  const double exact = 4 * std::numeric_limits<double>::epsilon() * std::max(std::abs(first), std::abs(last));
  // Times written with few decimals are off the grid by up to one unit of the last place (theirs and that of
  // t0). Where this is a large part of a step it could hide a missing sample, and the times must then be
  // exact.
  double rounding =
      stream.time_decimals() < 0 ? 0 : std::pow(10.0, -stream.time_decimals()) * unit.multiply / unit.divide;
  if (stated && rounding > 0) rounding = std::max(rounding, digits);
  // With the rate stated, the grid is known and a missing sample is off by a whole step.
  if (rounding > (stated ? 0.9 : 0.25) * mean_step) rounding = 0;
  double dt = simplest_step(mean_step, exact / steps);
  if (dt == mean_step) dt = simplest_step(mean_step, (rounding + exact) / steps);
  return {dt, rounding, exact};
}

namespace {

/// Step and start of a time column; unless it is a uniform grid, throws or, where gaps are let through, returns how far
/// (s) its times may be off by their rounding.
std::optional<double> uniform_time(const CsvStream& stream, const Eigen::VectorXd& t, const CsvOptions& options,
                                   Recording& record) {
  const Eigen::Index n = t.size();
  const bool few_digits = options.rate && t[n - 1] > t[0] && (t.tail(n - 1) - t.head(n - 1)).minCoeff() >= 0;
  if (few_digits && detail::agrees_coarsely(t, *options.rate)) {
    remark(record.source, "the times have too few digits; the rate that was given is taken");
    record.t0 = t[0];
    record.dt = 1 / *options.rate;
    return std::nullopt;
  }
  for (Eigen::Index i = 1; i < n; ++i) {
    if (!(t[i] > t[i - 1])) {
      const bool reversed = (t.tail(n - 1) - t.head(n - 1)).maxCoeff() < 0;
      throw Error::in_file(
          stream.source(), stream.line_of(i),
          fmt::format("time {} s does not follow {} s of the line before; time must increase{}", t[i], t[i - 1],
                      reversed           ? " (newest line first: sort the lines by time)"
                      : t[i] == t[i - 1] ? " (too few digits? state the rate: --rate HZ)"
                                         : ""));
    }
  }
  const double steps = static_cast<double>(n - 1);
  const double mean_step = (t[n - 1] - t[0]) / steps;
  constexpr double kLeastStep = 1e-12, kMostStep = 1e9;  // s: the range of --rate
  if (!(mean_step >= kLeastStep && mean_step <= kMostStep)) {
    throw Error::in_file(stream.source(), stream.line_of(n - 1),
                         fmt::format("the time runs from {:.9g} s to {:.9g} s over {} samples; a step must be within "
                                     "{:g} and {:g} s",
                                     t[0], t[n - 1], n, kLeastStep, kMostStep));
  }
  const detail::CsvGrid grid =
      detail::csv_grid(stream, t[0], t[n - 1], n, options.rate ? detail::six_digits(t) : 0, options.rate.has_value());
  const double rounding = grid.rounding;
  double dt = grid.dt;
  if (options.rate) {
    if (!(std::abs(*options.rate * dt - 1) < 1e-3 + rounding / (steps * mean_step))) {
      throw Error::in_file(
          stream.source(), 0,
          fmt::format("the rate given is {} Hz, but the time column has {:.9g} Hz", *options.rate, 1 / dt));
    }
    dt = 1 / *options.rate;
  }
  const double exact = grid.exact;
  const double allowed = options.time_tolerance * dt + rounding + exact;
  Eigen::Index worst = 0;
  bool good = true;
  for (Eigen::Index i = 1; i < n; ++i) {
    good = good && std::abs(t[i] - t[0] - static_cast<double>(i) * dt) <= allowed;
    if (worst == 0 || std::abs(t[i] - t[i - 1] - dt) > std::abs(t[worst] - t[worst - 1] - dt)) worst = i;
  }
  if (!good && options.gaps) return rounding + exact;
  if (!good) {
    throw Error::in_file(stream.source(), stream.line_of(worst),
                         fmt::format("time is not uniform: step {:.9g} s here, {:.9g} s on average; every time stamp "
                                     "must be within {} % of a step of a uniform grid{}",
                                     t[worst] - t[worst - 1], dt, 100 * options.time_tolerance,
                                     options.rate ? "" : " (times rounded? state the rate: --rate HZ)"));
  }
  record.t0 = t[0];
  record.dt = dt;
  return std::nullopt;
}

Recording read_record(CsvStream stream, const CsvOptions& options, CsvDialect* dialect) {
  if (options.rate) require_range("rate", *options.rate, 1e-9, 1e12, "Hz");
  if (stream.time_column() < 0 && !options.rate) {
    throw Error::in_file(stream.source(), stream.line_of(-1),
                         "no time column (e.g. 't_s'); add one or state the sample rate (--rate, Hz)");
  }
  Recording record;
  record.source = stream.source();
  record.channels = read_columns(stream, std::max<Eigen::Index>(options.min_samples, 2));
  if (const int time = stream.time_column(); time >= 0) {
    Eigen::VectorXd t = record.channels[static_cast<std::size_t>(time)].samples;
    for (const std::string& said : detail::join_rates(t, record.channels, static_cast<std::size_t>(time)))
      remark(record.source, said);
    const std::optional<double> uneven = uniform_time(stream, t, options, record);
    record.channels.erase(record.channels.begin() + time);
    if (uneven) remark(record.source, detail::take_to_even_grid(stream, t, options.time_tolerance, *uneven, record));
  } else {
    record.dt = 1 / *options.rate;
  }
  if (record.channels.empty()) throw Error::in_file(record.source, stream.line_of(-1), "no channel beside the time");
  if (options.refuse_constant) {
    for (const Channel& c : record.channels) {
      if (c.samples.minCoeff() == c.samples.maxCoeff()) {
        throw Error::in_file(record.source, 0,
                             fmt::format("channel '{}' is constant ({:g} {}); is the sensor connected?", c.name,
                                         c.samples[0], si_unit(c.quantity)));
      }
    }
  }
  if (dialect) *dialect = stream.dialect();
  return record;
}

Table read_table(CsvStream stream, const CsvOptions& options) {
  Table table;
  table.source = stream.source();
  table.first_line = stream.line_of(0);
  table.columns = read_columns(stream, std::max<Eigen::Index>(options.min_samples, 1));
  return table;
}

}  // namespace

Recording read_csv(const std::filesystem::path& path, const CsvOptions& options, CsvDialect* dialect) {
  return read_record(CsvStream(path, options), options, dialect);
}
Recording parse_csv(std::string_view bytes, std::string_view name, const CsvOptions& options) {
  return read_record(CsvStream(bytes, std::string(name), options), options, nullptr);
}
Table read_table(const std::filesystem::path& path, const CsvOptions& options) {
  return read_table(CsvStream(path, options), options);
}
Table parse_table(std::string_view bytes, std::string_view name, const CsvOptions& options) {
  return read_table(CsvStream(bytes, std::string(name), options), options);
}

const Channel* Table::find(std::string_view name) const {
  const auto it = std::find_if(columns.begin(), columns.end(), [&](const Channel& c) { return c.name == name; });
  return it == columns.end() ? nullptr : &*it;
}

const Channel& Table::at(std::string_view name) const {
  if (const Channel* c = find(name)) return *c;
  std::string present;
  for (const Channel& c : columns) present += (present.empty() ? "" : ", ") + c.name;
  throw MissingColumn(std::string(name), fmt::format("{}: no column '{}'; present: {}", source, name, present));
}

const Eigen::VectorXd& Table::in(std::string_view name, Quantity quantity) const {
  const Channel& column = at(name);
  if (column.quantity == quantity) return column.samples;
  throw Error::in_file(source, first_line - 1, quantity_problem(name, column.quantity, quantity));
}

}  // namespace whirl::io
