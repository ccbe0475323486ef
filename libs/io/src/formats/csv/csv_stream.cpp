#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "formats/csv/csv_fields.hpp"
#include "formats/csv/csv_header.hpp"
#include "formats/csv/csv_headless.hpp"
#include "formats/csv/csv_lines.hpp"
#include "formats/csv/csv_stamp.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kMaxColumns = 4096;
using detail::is_missing;
using detail::is_number;
using detail::parse_number;
using detail::Parsed;
using detail::shown;
using detail::split;
using detail::trim_of;
using detail::unquote;

}  // namespace

struct CsvStream::State : detail::CsvLines {
  CsvOptions options;
  CsvDialect dialect;
  std::vector<CsvColumn> columns;
  std::vector<detail::Heading> header;  // of the file; texts are empty when it has none
  std::vector<int> target;              // per file column: index in `columns`, -1 when not read
  long first_line = 0, units_line = 0;
  int time = -1;
  int decimals = 0;
  bool exponent = false;
  bool decimal_known = false, blank_seen = false;

  detail::StampColumns stamps;

  State(ByteSource s, const CsvOptions& o) : CsvLines(std::move(s)), options(o) {
    dialect.compressed = source.compressed();
    read_header();
  }

  [[noreturn]] void fail(std::string_view message, long at = -1) const {
    throw Error::in_file(source.name(), at < 0 ? line : at, message);
  }
  /// What `f` returns; its Error gets file and line.
  template <class F>
  auto placed(long at, F f) const {
    try {
      return f();
    } catch (const Error& e) {
      fail(e.what(), at);
    }
  }

  std::string column_name(std::size_t file_column) const {
    return !header[file_column].text.empty() ? fmt::format("column '{}'", shown(header[file_column].text))
                                             : fmt::format("column {}", file_column + 1);
  }

  void read_header() {
    refill();
    const std::string_view start(buffer.get(), end);
    if (start.substr(0, 3) == "\xef\xbb\xbf") {
      dialect.byte_order_mark = true;
      begin = 3;
    } else if (start.substr(0, 2) == "\xff\xfe" || start.substr(0, 2) == "\xfe\xff") {
      fail("is UTF-16 text; save it as UTF-8", 0);
    } else if (start.substr(0, 4) == "PK\x03\x04" || start.substr(0, 4) == "\xd0\xcf\x11\xe0") {
      fail(
          "is a workbook (.xlsx, .xls, .ods), not text; open it and save the sheet as 'CSV UTF-8', or run: libreoffice "
          "--headless --convert-to csv FILE",
          0);
    }
    std::string_view text;
    do {  // blank lines and comments may stand before the header
      if (!get_line(text))
        fail(options.header_line > line
                 ? fmt::format("has {} lines, the header shall be line {}", line, options.header_line)
                 : "has no header and no data",
             0);
      dialect.carriage_return = text.data()[text.size()] == '\r' && text.data() + text.size() < buffer.get() + end;
    } while (line < options.header_line || trim_of(text).empty() || text.front() == '#');
    if (text.find('\0') != std::string_view::npos) fail("holds zero bytes: this is no CSV file");
    if (text.find('\r') != std::string_view::npos) fail("lines end with CR alone: save them with LF or CR LF");

    if (text.size() == 5 && text.substr(0, 4) == "sep=") {  // written for spreadsheets
      const char said = text[4];
      if (!get_line(text)) fail("has no header and no data", 0);
      dialect.delimiter = said;
    } else {
      dialect.delimiter = detail::delimiter_of(text, untaken());
    }
    blanks_between = dialect.delimiter == ' ';
    if (blanks_between) {
      begin = static_cast<std::size_t>(text.data() - buffer.get()), --line;
      get_line(text);
    }
    const std::size_t header_begin =
        dialect.delimiter == ' ' ? 0 : static_cast<std::size_t>(text.data() - buffer.get());
    std::vector<std::string_view> fields = split(text, dialect.delimiter);
    if (fields.size() > 1 && trim_of(fields.back()).empty()) {
      dialect.trailing_delimiter = true;
      fields.pop_back();
    }
    if (fields.size() > kMaxColumns)
      fail(fmt::format("{} columns; at most {} are allowed", fields.size(), kMaxColumns));
    const bool headless = std::all_of(fields.begin(), fields.end(), [](auto f) { return is_number(unquote(f)); });
    if (headless) {
      if (options.columns.empty()) {
        const std::size_t count = fields.size();
        const long at = line;
        fail(
            fmt::format("no header; the first line must name the columns with their units, e.g. t_s,x_mm,y_mm, or name "
                        "those you need by their numbers, e.g. --columns {}",
                        detail::proposed_numbers(source.name(), count, first_values(text))),
            at);
      }
      header.resize(fields.size());
      if (dialect.delimiter == ' ') fail("values between blanks need a header line: write one, or save with commas");
      begin = header_begin;  // the line is data: read it again
      --line;
    } else {
      for (const std::string_view f : fields) header.push_back(detail::parse_heading(unquote(f)));
      read_units();
      std::vector<std::string> wanted = options.required;
      for (const std::string& spec : options.columns)
        if (spec.find(':') == std::string::npos) wanted.push_back(spec);
      detail::use_known_names(header, wanted);
      find_stamps();
    }
    first_line = line + 1;
    target.assign(fields.size(), -1);
    choose_columns();
  }

  /// The first column in this line and some that follow it. They are not read again.
  std::vector<double> first_values(std::string_view text) {
    constexpr std::size_t kLines = 6;
    std::vector<double> out;
    do {
      std::string value(unquote(split(text, dialect.delimiter).front()));
      std::ranges::replace(value, ',', '.');
      double number = 0;
      if (parse_number(value, number) != Parsed::good) break;
      out.push_back(number);
    } while (out.size() < kLines && get_line(text));
    return out;
  }

  /// The fields of a line of text that is in the buffer.
  std::vector<std::string> fields_of(std::string_view text) const {
    std::vector<std::string> fields;
    for (const std::string_view f : split(text, dialect.delimiter)) fields.push_back(detail::in_utf8(unquote(f)));
    if (dialect.trailing_delimiter && fields.size() > 1 && fields.back().empty()) fields.pop_back();
    return fields;
  }

  /// A line of units below the header, and the blank lines that instruments leave before the data.
  void read_units() {
    for (bool units = false;;) {
      const std::string_view ahead = untaken();
      const std::size_t newline = ahead.find('\n');
      if (newline == std::string_view::npos) return;
      const std::string_view text = trim_of(ahead.substr(0, newline), "\r");
      if (!trim_of(text).empty()) {
        if (units) return;
        units = placed(line + 1, [&] { return detail::take_units(header, fields_of(text)); });
        if (!units) return;
        units_line = line + 1;
      }
      begin += newline + 1;
      ++line;
    }
  }

  void find_stamps() {
    const std::string_view ahead = untaken();
    const std::string_view text = trim_of(ahead.substr(0, ahead.find('\n')), "\r");
    const bool numbered = std::any_of(header.begin(), header.end(), [](const detail::Heading& h) {
      return h.unit != nullptr && h.unit->quantity == Quantity::time && names_time(h);
    });
    stamps.find(fields_of(text), numbered, header);
  }

  void choose_columns() {
    const long at = line;
    if (options.columns.empty()) {
      for (std::size_t i = 0; i < header.size(); ++i)
        if (!stamps.unread(i)) add_column({i, header[i].name, header[i].unit}, header[i].text);
    }
    for (const std::string& spec : options.columns) {
      const detail::ColumnChoice choice = placed(at, [&] { return detail::choose_column(spec, header); });
      if (target[choice.heading] >= 0) fail(fmt::format("{} is named twice", column_name(choice.heading)));
      add_column(choice, spec.substr(spec.rfind(':') + 1));
    }
    if (columns.empty()) fail("no columns");
    for (std::size_t i = 0; time < 0 && !options.rate && i < header.size(); ++i) {  // the time need not be named
      const detail::Heading& h = header[i];  // an instrument calls it as it likes, but writes it first
      if (target[i] < 0 && h.unit && h.unit->quantity == Quantity::time && (names_time(h) || (i == 0 && h.foreign)))
        add_column({i, h.name, h.unit}, h.text);
    }
    for (const std::string& wanted : options.required) require_column(split_unit(wanted));
    if (time < 0 && !options.rate && target[0] >= 0 && header[0].foreign &&
        columns[static_cast<std::size_t>(target[0])].unit->quantity == Quantity::time)
      time = target[0];
  }

  static bool names_time(const detail::Heading& h) {
    const std::string name = channel_role(h.name);
    return name == "t" || name == "time";
  }

  void require_column(const NameWithUnit& wanted) const {
    std::string present;
    for (const CsvColumn& c : columns) {
      present += (present.empty() ? "" : ", ") + shown(c.name);
      if (c.name != wanted.name) continue;
      if (!wanted.unit || wanted.unit->quantity == c.unit->quantity) return;
      fail(quantity_problem(shown(c.header), c.unit->quantity, wanted.unit->quantity));
    }
    const std::string message = fmt::format("no column '{}' (with its unit, e.g. '{}_{}'); present: {}", wanted.name,
                                            wanted.name, wanted.unit ? wanted.unit->suffix : "mm", present);
    throw MissingColumn(wanted.name, Error::in_file(source.name(), line, message).what());
  }

  /// `written`: the name with its unit, for messages.
  void add_column(const detail::ColumnChoice& choice, const std::string& written) {
    if (choice.name.empty()) fail(fmt::format("column {} has no name", choice.heading + 1));
    if (!choice.unit) {
      if (const std::optional<long> at = header_line())
        fail(fmt::format("line {} looks like the header: --header-line {} (column '{}' of this line has no unit)", *at,
                         *at, shown(written)));
      const detail::Heading& h = header[choice.heading];
      fail(detail::unit_failure(header, choice.heading, written, options.required), h.label.empty() ? -1 : units_line);
    }
    for (const CsvColumn& other : columns) {
      if (other.name == choice.name)
        fail(fmt::format("two columns are called '{}'; name those you need by their numbers: --columns {}",
                         shown(choice.name), detail::proposed_columns(header, true, options.required)));
    }
    if (const std::string said = detail::dropped_kind(header[choice.heading], choice); !said.empty())
      remark(source.name(), said);
    const int at = static_cast<int>(columns.size());
    target[choice.heading] = at;
    detail::Heading named = header[choice.heading];
    named.name = choice.name;
    if (names_time(named) && choice.unit->quantity == Quantity::time) time = at;
    const std::string& text = header[choice.heading].text;
    columns.push_back({text.empty() ? written : text, choice.name, choice.unit, choice.factor});
  }

  /// The line among the next that looks like the header.
  std::optional<long> header_line() const {
    std::string_view ahead = untaken();
    std::optional<long> names;  // the last line with text: a line of units may follow it
    for (long at = line + 1; at <= line + 100 && !ahead.empty(); ++at) {
      const std::size_t newline = ahead.find('\n');
      const std::string_view text = trim_of(ahead.substr(0, newline), " \r");
      ahead.remove_prefix(newline == std::string_view::npos ? ahead.size() : newline + 1);
      for (const char delimiter : {';', '\t', ','}) {
        const std::vector<std::string_view> fields = split(text, delimiter);
        long known = 0, bare = 0;
        for (const std::string_view f : fields) {
          const detail::Heading h = detail::parse_heading(unquote(f));
          known += h.unit != nullptr && !h.name.empty();
          bare += !is_number(unquote(f)) && (h.name.empty() ? h.unit : unit_from_label(unquote(f))) != nullptr;
        }
        const long least = std::max(2L, static_cast<long>(fields.size()) - 1);
        if (known >= least) return at;
        if (bare >= least && names) return names;
      }
      if (!text.empty()) names = at;
    }
    return std::nullopt;
  }

  /// Decides the decimal sign from the first value in the buffer that has one.
  void find_decimal() {
    decimal_known = true;
    if (options.decimal) {
      if (*options.decimal == ',' && dialect.delimiter == ',') {
        fail("decimal commas need ';' or tab between the values, not ','", 0);
      }
      dialect.decimal = *options.decimal;
    } else if (dialect.delimiter != ',') {
      std::string_view ahead = untaken();
      if (const std::size_t last = ahead.rfind('\n'); last != std::string_view::npos) ahead = ahead.substr(0, last);
      std::size_t column = 0;
      while (!ahead.empty()) {  // dates and times have points of their own
        const std::size_t stop = std::min(ahead.find_first_of(std::string{dialect.delimiter, '\n'}), ahead.size());
        const std::string_view field = ahead.substr(0, stop);
        const std::size_t sign = stamps.has(column) ? field.npos : field.find_first_of(".,");
        if (sign != std::string_view::npos) {
          dialect.decimal = field[sign];
          return;
        }
        column = stop < ahead.size() && ahead[stop] == '\n' ? 0 : column + 1;
        ahead.remove_prefix(std::min(stop + 1, ahead.size()));
      }
    }
  }

  double slow_value(std::string_view field, std::size_t file_column) const {
    const std::string_view text = unquote(trim_of(field, " \t\r"));
    const auto bad = [&](std::string_view why) {
      fail(fmt::format("{}: '{}' {}", column_name(file_column), shown(text), why));
    };
    if (options.gaps && target[file_column] != time && is_missing(text))
      return std::numeric_limits<double>::quiet_NaN();
    if (text.empty())
      fail(
          fmt::format("{}: empty in row {} of the record, counted from 0; every value must be a number here. info, "
                      "identify, validate and convert without --stream take gaps. Else choose rows without them "
                      "(--rows FIRST:END). Several rates in one table: export one table for each rate",
                      column_name(file_column), line - first_line));
    std::string copy(text);
    if (dialect.delimiter != ',') {
      const char other = dialect.decimal == ',' ? '.' : ',';
      if (copy.find(other) != std::string::npos) {
        bad(fmt::format("has the decimal sign '{}' where the file uses '{}'", other, dialect.decimal));
      }
      std::replace(copy.begin(), copy.end(), ',', '.');
    }
    double value = 0;
    const Parsed outcome = parse_number(copy, value);
    if (outcome == Parsed::bad)
      bad(target[file_column] == time
              ? "is not a number; every value must be a finite number (a line of remarks or sums? delete it)"
              : "is not a number; every value must be a finite number (correct it, or delete the line)");
    if (outcome == Parsed::not_finite) bad("is not finite; every value must be a finite number");
    return value;
  }

  [[noreturn]] void ragged(std::string_view text) const {
    const std::size_t have = split(text, dialect.delimiter).size();
    const std::size_t want = target.size() + (dialect.trailing_delimiter ? 1 : 0);
    const char* advice = have < want ? "; the line is cut short: complete or delete it" : "";
    if (dialect.delimiter == ',' && have > want && have <= 2 * want && !dialect.trailing_delimiter)
      advice =
          "; decimal commas need ';' between the values: export with ';' or tabs between them, or with decimal points";
    fail(fmt::format("{} values, but the {} {}{}", have, header[0].text.empty() ? "first line has" : "header has", want,
                     advice));
  }

  void note_time_digits(const char* p, const char* q) {
    const char* point = nullptr;
    for (const char* s = p; s < q; ++s) {
      if (*s == '.' || *s == ',') point = s;
      if (*s == 'e' || *s == 'E') exponent = true;
    }
    if (point) decimals = std::max(decimals, static_cast<int>(q - point) - 1);
  }

  void parse_line(std::string_view text, double* row, Eigen::Index stride) {
    const char* p = text.data();
    const char* const e = p + text.size();
    const std::size_t n = target.size();
    for (std::size_t i = 0; i < n; ++i) {
      const int t = target[i];
      const char* q = p;
      double value = 0;
      bool fast = false;
      const bool of_time = stamps.has(i);
      if (t >= 0 && !of_time) {
        const auto [stop, ec] = std::from_chars(p, e, value);
        q = stop;
        fast = ec == std::errc{} && (q == e || *q == dialect.delimiter) && std::isfinite(value) &&
               (dialect.decimal == '.' || std::find(p, q, '.') == q);
      }
      if (!fast) {
        q = p;
        bool quoted = false;
        for (; q < e && (quoted || *q != dialect.delimiter); ++q) quoted ^= *q == '"';
      }
      const bool last = i + 1 == n;
      const bool more = q < e;
      if (more == (last && !dialect.trailing_delimiter)) ragged(text);
      if (of_time) {
        const std::string_view written = unquote(trim_of({p, static_cast<std::size_t>(q - p)}, " \t\r"));
        if (!stamps.take(i, written))
          fail(fmt::format("{}: '{}' is no date or time as in the first line", column_name(i), shown(written)));
      } else if (t >= 0) {
        if (!fast) value = slow_value({p, static_cast<std::size_t>(q - p)}, i);
        if (t == time) note_time_digits(p, q);
        const CsvColumn& column = columns[static_cast<std::size_t>(t)];
        row[t * stride] = column.unit->to_si(column.factor * value);
      }
      p = more ? q + 1 : q;
    }
    if (const int at = stamps.time_column(); at >= 0) {
      const double seconds = stamps.seconds();
      if (const int t = target[static_cast<std::size_t>(at)]; t >= 0) row[t * stride] = seconds;
      decimals = std::max(decimals, stamps.decimals());
    }
    if (dialect.trailing_delimiter && !trim_of({p, static_cast<std::size_t>(e - p)}).empty()) ragged(text);
  }
};

CsvStream::CsvStream(const std::filesystem::path& path, const CsvOptions& options)
    : state_(std::make_unique<State>(ByteSource(path), options)) {}
CsvStream::CsvStream(std::string_view bytes, std::string name, const CsvOptions& options)
    : state_(std::make_unique<State>(ByteSource(bytes, std::move(name)), options)) {}
CsvStream::~CsvStream() = default;
CsvStream::CsvStream(CsvStream&&) noexcept = default;

const std::string& CsvStream::source() const { return state_->source.name(); }
const CsvDialect& CsvStream::dialect() const { return state_->dialect; }
const std::vector<CsvColumn>& CsvStream::columns() const { return state_->columns; }
long CsvStream::line_of(Eigen::Index row) const { return state_->first_line + static_cast<long>(row); }
int CsvStream::time_column() const { return state_->time; }
std::uint64_t CsvStream::bytes_read() const { return state_->source.taken(); }
int CsvStream::time_decimals() const { return state_->exponent ? -1 : state_->decimals; }

Eigen::Index CsvStream::next(Eigen::Ref<Eigen::MatrixXd> block) {
  State& s = *state_;
  if (block.cols() != static_cast<Eigen::Index>(s.columns.size())) {
    throw Error(fmt::format("CsvStream::next: block has {} columns, the file {}", block.cols(), s.columns.size()));
  }
  if (!s.decimal_known) s.find_decimal();
  Eigen::Index row = 0;
  std::string_view text;
  while (row < block.rows() && s.get_line(text)) {
    if (text.empty() || trim_of(text).empty()) {
      s.blank_seen = true;
      continue;
    }
    if (s.blank_seen) s.fail("data after an empty line; remove the empty lines (are samples missing?)");
    s.parse_line(text, block.data() + row, block.outerStride());
    ++row;
    if (s.open_line && !s.dialect.trailing_delimiter)
      remark(s.source.name(), fmt::format("line {} has no line end: its last number may be cut off", s.line),
             RemarkCode::open_last_line);
  }
  return row;
}

}  // namespace whirl::io
