#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "formats/text_lines.hpp"
#include "formats/uff/uff_binary.hpp"
#include "formats/uff/uff_points.hpp"
#include "formats/uff/uff_window.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::io {
namespace {

// A line with the number of a dataset that is read here, and nothing else.
bool names_dataset(std::string_view line) {
  const std::string_view word = trim(line.substr(0, 6));
  const std::string_view rest = line.size() > 6 ? line.substr(6) : std::string_view();
  if (word == "58" && !rest.empty() && (rest[0] == 'b' || rest[0] == 'B')) return true;
  if (!trim(rest).empty()) return false;
  for (const char* known : {"15", "18", "55", "58", "82", "151", "164", "1858", "2411", "2412"})
    if (word == known) return true;
  return false;
}

class UffReader {
 public:
  UffReader(std::string_view bytes, std::string_view name) : lines_(bytes, std::string(name)) { file_.source = name; }

  UffFile read() {
    bool follows_block = false;
    while (!lines_.done()) {
      // A block without the -1 before it: the one of the block before it serves both.
      const bool bare = follows_block && names_dataset(lines_.peek());
      follows_block = false;
      if (bare) {
        warn(fmt::format("line {}: dataset {} begins without -1 before it", lines_.line() + 1, trim(lines_.peek())));
      } else if (!is_delimiter(lines_.next())) {
        continue;  // text between blocks
      }
      if (lines_.done()) {
        warn(fmt::format("line {}: -1 begins a dataset, and the file ends: cut off?", lines_.line()));
        break;
      }
      read_block();
      follows_block = true;
    }
    if (const auto present = static_cast<long>(file_.functions.size()); present < stated_)
      warn(fmt::format("cut off: it states {} functions, {} are present", stated_, present));
    if (file_.units.size() > 1)
      warn("more than one unit system (dataset 164): the units of each value are not certain");
    return std::move(file_);
  }

 private:
  void warn(const std::string& message) { file_.warnings.push_back(message); }

  // A code of the format: what does not fit an int is none.
  int small(long value) const {
    if (value < -99999999 || value > 999999999) lines_.fail(fmt::format("code {}: too large", value));
    return static_cast<int>(value);
  }

  // Next line of a block's fixed part.
  std::string_view header_line(const char* what) {
    if (lines_.done()) lines_.fail(fmt::format("file ends inside the {}", what));
    return lines_.next();
  }
  // True at the end of the block (the delimiter is consumed) or of the file.
  bool block_ends() {
    if (lines_.done()) {
      warn(fmt::format("line {}: the last block is not closed by -1", lines_.line()));
      return true;
    }
    if (!is_delimiter(lines_.peek())) return false;
    lines_.next();
    return true;
  }
  void skip_block() {
    while (!block_ends()) lines_.next();
  }

  void read_block() {
    const std::string_view line = lines_.next();
    std::string_view number = columns(line, 0, 6);
    const bool binary = line.size() > 6 && (line[6] == 'b' || line[6] == 'B');
    UffBinary form;
    if (binary) {
      form.binary = true;
      const long order = integer(lines_, line, 7, 6);
      const long floats = integer(lines_, line, 13, 6);
      if (order != 1 && order != 2)
        lines_.fail(fmt::format("byte order {}: must be 1 (little) or 2 (big endian)", order));
      if (floats != 2) lines_.fail(fmt::format("floating-point format {}: only 2 (IEEE) can be read", floats));
      form.little = order == 1;
      const long bytes = integer(lines_, line, 31, 12);
      if (bytes < 0) lines_.fail(fmt::format("{} bytes of data: must not be negative", bytes));
      form.bytes = static_cast<std::size_t>(bytes);
    }
    if (is_delimiter(line)) return;  // empty block
    const long dataset = integer(lines_, number, 0, 6);
    if (binary && dataset != 58) lines_.fail(fmt::format("dataset {}b: only 58 may be binary", dataset));
    switch (dataset) {
      case 58:
        read_function(form);
        break;
      case 55:
        read_shape();
        break;
      case 15:
        read_nodes();
        break;
      case 2411:
        read_nodes_double();
        break;
      case 2412:
        read_elements();
        break;
      case 82:
        read_trace();
        break;
      case 18:
        read_systems();
        break;
      case 151:
        while (!block_ends()) file_.header.push_back(text_of(lines_.next()));
        break;
      case 164:
        read_units();
        break;
      case 1858:
        read_qualifiers();
        break;
      default:
        file_.skipped.push_back(static_cast<int>(dataset));
        skip_block();
    }
  }

  UffAxis axis() {
    const std::string_view line = header_line("axes of a function");
    return {small(integer(lines_, line, 0, 10)), text_of(columns(line, 26, 20)), text_of(columns(line, 47, 20))};
  }

  void read_function(const UffBinary& form) {
    UffFunction f;
    for (auto& id : f.id) id = text_of(header_line("ID lines of a function"));
    if (long number = 0, count = 0; std::sscanf(f.id[3].c_str(), "function %ld of %ld", &number, &count) == 2) {
      stated_ = std::max(stated_, count);
      f.id[3] = "NONE";
    }
    std::string_view line = header_line("header of a function");
    if (read_points_by_blanks(line, f)) {
      warn(fmt::format("line {}: names '{}' and '{}', one of more than 10 characters: this line is read by blanks",
                       lines_.line(), f.response.name, f.reference.name));
    } else {
      f.type = small(integer(lines_, line, 0, 5));
      f.response = {text_of(columns(line, 31, 10)), integer(lines_, line, 41, 10), small(integer(lines_, line, 51, 4))};
      f.reference = {text_of(columns(line, 56, 10)), integer(lines_, line, 66, 10),
                     small(integer(lines_, line, 76, 4))};
    }
    line = header_line("header of a function");
    const long ordinate = integer(lines_, line, 0, 10);
    if (ordinate != 2 && ordinate != 4 && ordinate != 5 && ordinate != 6) {
      lines_.fail(fmt::format("ordinate type {}: must be 2, 4, 5 or 6", ordinate));
    }
    f.complex = ordinate >= 5;
    f.single = ordinate == 2 || ordinate == 5;
    f.declared = integer(lines_, line, 10, 10);
    if (f.declared < 0) lines_.fail(fmt::format("{} values: must not be negative", f.declared));
    f.even = integer(lines_, line, 20, 10) != 0;
    std::vector<double> steps;
    append_numbers(lines_, line.size() > 30 ? line.substr(30) : std::string_view{}, steps);
    if (steps.size() < 2) lines_.fail("abscissa minimum and increment are missing");
    f.x0 = steps[0];
    f.dx = steps[1];
    // Start and step in full, where this program wrote them: taken when they round to the header's.
    double start = 0, step = 0;
    if (std::sscanf(f.id[4].c_str(), "abscissa start %lf step %lf", &start, &step) == 2 &&
        std::abs(step - f.dx) <= 1e-5 * std::abs(f.dx) && std::abs(start - f.x0) <= 1e-5 * std::abs(f.x0)) {
      f.x0 = start;
      f.dx = step;
    }
    f.abscissa = axis();
    f.ordinate = axis();
    f.denominator = axis();
    f.z = axis();
    const std::size_t per_value = (f.complex ? 2 : 1) + (f.even ? 0 : 1);
    std::vector<double> numbers;
    if (form.binary) {
      numbers = binary_numbers(lines_, form, f, per_value, file_.warnings);
      // CR LF or nothing may stand before the closing -1; a wrong byte count leaves more.
      while (!block_ends()) lines_.next();
    } else {
      const std::size_t wanted = static_cast<std::size_t>(f.declared) * per_value;
      numbers.reserve(std::min(wanted, lines_.remaining() / 2 + 8));
      bool ended = false;
      while (numbers.size() < wanted && !(ended = block_ends())) append_numbers(lines_, lines_.next(), numbers);
      if (!ended) leave_function(f);
      if (numbers.size() > wanted) numbers.resize(wanted);
    }
    const auto count = static_cast<Eigen::Index>(numbers.size() / per_value);
    if (count < f.declared) {
      warn(fmt::format("line {}: function '{}' declares {} values, {} are present", lines_.line(), f.id[0], f.declared,
                       count));
    }
    f.value.resize(count);
    if (!f.even) f.x.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double* at = numbers.data() + static_cast<std::size_t>(i) * per_value;
      if (!f.even) f.x[i] = *at++;
      f.value[i] = {at[0], f.complex ? at[1] : 0.0};
    }
    warn_of_window(f.type);
    file_.functions.push_back(std::move(f));
  }

  // To the end of a block whose values are all read. What else stands there is told, and a dataset whose block begins
  // without any -1 is left to be read.
  void leave_function(const UffFunction& f) {
    long more = 0;
    bool closed = false;
    while (!closed && !(closed = block_ends()) && !names_dataset(lines_.peek())) {
      more += trim(lines_.next()).empty() ? 0 : 1;
    }
    if (more > 0) {
      warn(fmt::format("line {}: function '{}' declares {} values; {} more lines of its block are left out",
                       lines_.line(), f.id[0], f.declared, more));
    }
  }

  void read_shape() {
    UffShape s;
    for (auto& id : s.id) id = text_of(header_line("ID lines of a shape"));
    std::string_view line = header_line("header of a shape");
    s.analysis = small(integer(lines_, line, 10, 10));
    s.characteristic = small(integer(lines_, line, 20, 10));
    s.specific = small(integer(lines_, line, 30, 10));
    const long data = integer(lines_, line, 40, 10);
    if (data != 2 && data != 5) lines_.fail(fmt::format("data type {}: must be 2 (real) or 5 (complex)", data));
    s.complex = data == 5;
    const long per_node = integer(lines_, line, 50, 10);
    if (per_node < 1 || per_node > 100) lines_.fail(fmt::format("{} values per node: must be 1 to 100", per_node));
    line = header_line("header of a shape");
    const long integers = integer(lines_, line, 0, 10), reals = integer(lines_, line, 10, 10);
    if (integers < 0 || integers > 100 || reals < 0 || reals > 100)
      lines_.fail("counts of the header must be 0 to 100");
    for (long i = 0; i < integers; ++i) {
      const long column = (i + 2) % 8;
      if (column == 0) line = header_line("header of a shape");
      s.integers.push_back(integer(lines_, line, static_cast<std::size_t>(column) * 10, 10));
    }
    while (s.reals.size() < static_cast<std::size_t>(reals))
      append_numbers(lines_, header_line("header of a shape"), s.reals);
    s.reals.resize(static_cast<std::size_t>(reals));
    const std::size_t width = static_cast<std::size_t>(per_node) * (s.complex ? 2 : 1);
    std::vector<double> values;
    while (!block_ends()) {
      // The label alone on its line: some writers leave the ten columns.
      const long node = integer(lines_, lines_.next(), 0, 80);
      std::vector<double> row;
      bool cut = false;
      while (row.size() < width && !cut) {
        cut = lines_.done() || is_delimiter(lines_.peek());
        if (!cut) append_numbers(lines_, lines_.next(), row);
      }
      if (cut) {
        warn(fmt::format("line {}: values of node {} are cut off", lines_.line(), node));
        continue;
      }
      s.nodes.push_back(node);
      values.insert(values.end(), row.begin(), row.begin() + static_cast<std::ptrdiff_t>(width));
    }
    s.value.resize(static_cast<Eigen::Index>(s.nodes.size()), per_node);
    const double* at = values.data();
    for (Eigen::Index n = 0; n < s.value.rows(); ++n) {
      for (Eigen::Index k = 0; k < per_node; ++k, at += s.complex ? 2 : 1)
        s.value(n, k) = {at[0], s.complex ? at[1] : 0.0};
    }
    file_.shapes.push_back(std::move(s));
  }

  Eigen::Vector3d three_numbers(std::string_view text) {
    std::vector<double> p;
    append_numbers(lines_, text, p);
    if (p.size() < 3) lines_.fail("three coordinates are expected");
    return {p[0], p[1], p[2]};
  }

  void read_nodes() {
    while (!block_ends()) {
      const std::string_view line = lines_.next();
      file_.nodes.push_back({integer(lines_, line, 0, 10), three_numbers(line.size() > 40 ? line.substr(40) : "")});
    }
  }

  void read_nodes_double() {
    while (!block_ends()) {
      const long label = integer(lines_, lines_.next(), 0, 10);
      file_.nodes.push_back({label, three_numbers(header_line("coordinates of a node"))});
    }
  }

  void read_labels(std::size_t count, std::vector<long>& labels, const char* what) {
    while (labels.size() < count) {
      if (lines_.done() || is_delimiter(lines_.peek()))
        lines_.fail(fmt::format("{} lists {} of {} nodes", what, labels.size(), count));
      const std::string_view line = lines_.next();
      for (std::size_t k = 0; k < 8 && labels.size() < count && !columns(line, 10 * k, 10).empty(); ++k) {
        labels.push_back(integer(lines_, line, 10 * k, 10));
      }
    }
  }

  void read_elements() {
    while (!block_ends()) {
      const std::string_view line = lines_.next();
      UffElement element{integer(lines_, line, 0, 10), small(integer(lines_, line, 10, 10)), {}};
      const long count = integer(lines_, line, 50, 10);
      if (count < 0 || count > 10000) lines_.fail(fmt::format("element of {} nodes: must be 0 to 10000", count));
      const bool beam = element.type == 11 || (element.type >= 21 && element.type <= 24);
      if (beam) header_line("orientation of a beam element");
      read_labels(static_cast<std::size_t>(count), element.nodes, "element");
      file_.elements.push_back(std::move(element));
    }
  }

  void read_trace() {
    const std::string_view line = header_line("header of a trace line");
    const long count = integer(lines_, line, 10, 10);
    if (count < 0) lines_.fail(fmt::format("trace line of {} nodes: must not be negative", count));
    UffTrace trace;
    trace.id = text_of(header_line("name of a trace line"));
    read_labels(static_cast<std::size_t>(count), trace.nodes, "trace line");
    file_.traces.push_back(std::move(trace));
    skip_block();
  }

  void read_systems() {
    while (!block_ends()) {
      const std::string_view line = lines_.next();
      UffSystem system;
      system.label = integer(lines_, line, 0, 10);
      system.type = small(integer(lines_, line, 10, 10));
      system.name = text_of(header_line("name of a coordinate system"));
      std::vector<double> p;
      while (p.size() < 9) append_numbers(lines_, header_line("axes of a coordinate system"), p);
      system.origin = Eigen::Map<Eigen::Vector3d>(p.data());
      system.x_point = Eigen::Map<Eigen::Vector3d>(p.data() + 3);
      system.xz_point = Eigen::Map<Eigen::Vector3d>(p.data() + 6);
      file_.systems.push_back(std::move(system));
    }
  }

  void read_units() {
    const std::string_view line = header_line("units");
    UffUnits units;
    units.code = small(integer(lines_, line, 0, 10));
    units.description = text_of(columns(line, 10, 20));
    std::vector<double> factors;
    while (factors.size() < 4 && !lines_.done() && !is_delimiter(lines_.peek()))
      append_numbers(lines_, lines_.next(), factors);
    if (factors.size() < 3) lines_.fail("length, force and temperature factors are expected");
    units.length = factors[0];
    units.force = factors[1];
    units.temperature = factors[2];
    if (factors.size() > 3) units.temperature_offset = factors[3];
    file_.units.push_back(units);
    skip_block();
  }

  // Of the functions that follow. Only the window matters to what is read.
  void read_qualifiers() {
    std::vector<std::string_view> records;
    while (!block_ends()) records.push_back(lines_.next());
    if (records.size() < 2) return;
    window_.code = integer(lines_, records[1], 6, 6);
    std::vector<double> values;
    if (records.size() > 3) append_numbers(lines_, records[3], values);
    window_.factor = values.size() > 4 ? values[4] : 0;
  }

  // A window is left in the functions: said once, of the first frequency response behind one.
  void warn_of_window(int function) {
    constexpr int kFrequencyResponse = 4;
    if (window_said_ || function != kFrequencyResponse || window_.remark().empty()) return;
    warn(window_.remark());
    window_said_ = true;
  }

  TextLines lines_;
  UffFile file_;
  UffWindow window_;
  bool window_said_ = false;
  long stated_ = 0;  ///< number of functions, where the file says it
};

}  // namespace

UffFile parse_uff(std::string_view bytes, std::string_view name) {
  const std::string text = decompress(bytes, name);
  UffFile file = UffReader(text, name).read();
  const bool empty = file.functions.empty() && file.shapes.empty() && file.nodes.empty() && file.traces.empty() &&
                     file.elements.empty() && file.systems.empty() && file.units.empty() && file.header.empty() &&
                     file.skipped.empty();
  if (empty) throw Error::in_file(name, 0, "no dataset found: not a universal file");
  return file;
}

UffFile read_uff(const std::filesystem::path& path) { return parse_uff(read_text(path), path.string()); }

}  // namespace whirl::io
