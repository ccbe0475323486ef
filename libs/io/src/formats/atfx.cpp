#include "whirl/io/atfx.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <pugixml.hpp>

#include "format.hpp"
#include "formats/arrays/bytes.hpp"
#include "formats/text_lines.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

// Rows that the file does not hold: so many in all, which are 128 MB.
constexpr double kMostImplicitRows = 8'000'000;

constexpr std::pair<std::string_view, NumberType> kAtfxTypes[] = {
    {"ieeefloat8", NumberType::float64}, {"ieeefloat4", NumberType::float32}, {"dt_longlong", NumberType::int64},
    {"dt_long", NumberType::int32},      {"dt_ulong", NumberType::uint32},    {"dt_short", NumberType::int16},
    {"dt_ushort", NumberType::uint16},   {"dt_sbyte", NumberType::int8},      {"dt_byte", NumberType::uint8},
    {"dt_boolean", NumberType::uint8}};

// Concerns one column; the others can still be read.
struct ColumnProblem : Error {
  using Error::Error;
};

// What the instances of one base type are called in this file.
struct AtfxElement {
  std::string name;
  std::map<std::string, std::string> attribute;  // base attribute or base relation -> name
};

std::string child(const pugi::xml_node& node, const AtfxElement& element, const char* base) {
  const auto found = element.attribute.find(base);
  return found == element.attribute.end() ? std::string() : std::string(node.child_value(found->second.c_str()));
}

std::vector<std::string> words(std::string_view text) {
  std::vector<std::string> result;
  std::size_t i = 0;
  while (i < text.size()) {
    while (i < text.size() && std::isspace(static_cast<unsigned char>(text[i]))) ++i;
    const std::size_t start = i;
    while (i < text.size() && !std::isspace(static_cast<unsigned char>(text[i]))) ++i;
    if (i > start) result.emplace_back(text.substr(start, i - start));
  }
  return result;
}

class AtfxReader {
 public:
  AtfxReader(std::string_view bytes, std::string_view name, const AtfxComponents& components)
      : name_(name), components_(components) {
    const pugi::xml_parse_result parsed = document_.load_buffer(bytes.data(), bytes.size());
    if (!parsed) throw Error::in_file(name_, 0, fmt::format("byte {}: {}", parsed.offset, parsed.description()));
    root_ = document_.child("atfx_file");
    if (!root_) throw Error::in_file(name_, 0, "no element atfx_file: not an ATFX file");
    file_.source = name_;
  }

  AtfxFile read() {
    for (const auto& part : root_.child("files").children("component")) {
      binary_name_[part.child_value("identifier")] = part.child_value("filename");
    }
    for (const auto& element : root_.child("application_model").children("application_element")) read_element(element);
    const pugi::xml_node data = root_.child("instance_data");
    const AtfxElement& quantity = elements_["AoMeasurementQuantity"];
    const AtfxElement& unit = elements_["AoUnit"];
    const AtfxElement& table = elements_["AoSubmatrix"];
    for (const auto& u : data.children(unit.name.c_str())) {
      unit_name_[child(u, unit, "id")] = child(u, unit, "name");
      // Some writers state the relation from this side only.
      for (const auto& q : words(child(u, unit, "measurement_quantities")))
        unit_of_quantity_[q] = child(u, unit, "name");
    }
    for (const auto& q : data.children(quantity.name.c_str())) quantities_[child(q, quantity, "id")] = q;
    for (const auto& t : data.children(table.name.c_str()))
      rows_[child(t, table, "id")] = child(t, table, "number_of_rows");
    const AtfxElement& column = elements_["AoLocalColumn"];
    if (!column.name.empty()) {
      for (const auto& c : data.children(column.name.c_str())) {
        keep_going([&] { read_column(c, column); });
      }
    }
    fill_implicit();
    const bool any = std::any_of(file_.columns.begin(), file_.columns.end(),
                                 [](const AtfxColumn& c) { return c.size() > 0 || !c.text.empty(); });
    if (!any && !problems_.empty()) throw Error(problems_.front());
    return std::move(file_);
  }

 private:
  struct Implicit {
    std::size_t column;
    std::string table;
    double start, step;
    std::string text;
  };

  [[noreturn]] void fail(const std::string& message) const {
    throw ColumnProblem(Error::in_file(name_, 0, message).what());
  }

  // A column that cannot be read is left out and named.
  template <class Step>
  void keep_going(Step step) {
    try {
      step();
    } catch (const ColumnProblem& problem) {
      problems_.emplace_back(problem.what());
      std::string text = problem.what();
      if (text.starts_with(name_ + ": ")) text = text.substr(name_.size() + 2);
      file_.warnings.push_back("left out: " + text);
    }
  }

  void read_element(const pugi::xml_node& node) {
    AtfxElement element;
    element.name = node.child_value("name");
    for (const auto& a : node.children("application_attribute")) {
      if (*a.child_value("base_attribute") != '\0')
        element.attribute[a.child_value("base_attribute")] = a.child_value("name");
    }
    for (const auto& r : node.children("relation_attribute")) {
      if (*r.child_value("base_relation") != '\0')
        element.attribute[r.child_value("base_relation")] = r.child_value("name");
    }
    elements_.emplace(node.child_value("basetype"), element);
  }

  double number(const std::string& word, const std::string& column) const {
    if (const auto value = signed_number_of<double>(word)) return *value;
    fail(fmt::format("column '{}': '{}' must be a number", column, word.substr(0, 40)));
  }

  static Eigen::VectorXcd as_column(const std::vector<double>& numbers, bool complex) {
    Eigen::VectorXcd value(static_cast<Eigen::Index>(numbers.size() / (complex ? 2 : 1)));
    for (Eigen::Index i = 0; i < value.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      value[i] = complex ? std::complex<double>(numbers[2 * k], numbers[2 * k + 1]) : std::complex<double>(numbers[k]);
    }
    return value;
  }

  void read_column(const pugi::xml_node& node, const AtfxElement& element) {
    AtfxColumn column;
    column.name = child(node, element, "name");
    column.independent = child(node, element, "independent") == "1";
    const std::string table = child(node, element, "submatrix");
    std::from_chars(table.data(), table.data() + table.size(), column.submatrix);
    const std::string flag = child(node, element, "global_flag");
    if (!flag.empty() && flag != "15")
      file_.warnings.push_back(fmt::format("column '{}' is flagged {}, not valid throughout", column.name, flag));

    bool complex = false;
    const auto quantity = quantities_.find(child(node, element, "measurement_quantity"));
    if (quantity != quantities_.end()) {
      const AtfxElement& q = elements_["AoMeasurementQuantity"];
      complex = child(quantity->second, q, "datatype").find("COMPLEX") != std::string::npos;
      const auto unit = unit_name_.find(child(quantity->second, q, "unit"));
      column.unit = unit != unit_name_.end() ? unit->second : unit_of_quantity_[quantity->first];
    }

    const std::string representation = child(node, element, "sequence_representation");
    const auto values_name = element.attribute.find("values");
    const pugi::xml_node values =
        values_name == element.attribute.end() ? pugi::xml_node() : node.child(values_name->second.c_str());
    const pugi::xml_node part = values.child("component");
    pugi::xml_node inline_values;
    for (const auto& v : values.children()) {
      if (std::string_view(v.name()).starts_with("A_")) inline_values = v;
    }
    const std::string_view type = inline_values.name();
    if (representation.starts_with("implicit")) {
      column.implicit = true;
      std::vector<std::string> parameters = words(inline_values.child_value());
      if (parameters.empty()) parameters = words(child(node, element, "generation_parameters"));
      Implicit implicit{file_.columns.size(), table, 0, 0, inline_values.child_value("s")};
      if (implicit.text.empty()) {
        if (parameters.empty()) fail(fmt::format("implicit column '{}' has no parameters", column.name));
        implicit.start = number(parameters[0], column.name);
        if (representation == "implicit_linear") {
          if (parameters.size() < 2)
            fail(fmt::format("implicit column '{}': start and increment are expected", column.name));
          implicit.step = number(parameters[1], column.name);
        } else if (representation != "implicit_constant") {
          fail(fmt::format("column '{}': representation '{}' cannot be read", column.name, representation));
        }
      }
      implicit_.push_back(std::move(implicit));
    } else if (part) {
      column.complex = complex;
      column.value = as_column(read_component(part, column.name), complex);
    } else if (type == "A_UTF8STRING" || type == "A_ASCIISTRING") {
      for (const auto& s : inline_values.children("s")) column.text.emplace_back(s.child_value());
    } else if (type == "A_TIMESTRING") {
      column.text = words(inline_values.child_value());
    } else if (type == "A_BYTEFIELD") {
      for (const auto& s : inline_values.children("sequence")) column.text.emplace_back(s.child_value());
    } else if (type == "A_BOOLEAN") {
      std::vector<double> numbers;
      for (const auto& w : words(inline_values.child_value())) numbers.push_back(w == "true" || w == "1" ? 1 : 0);
      column.value = as_column(numbers, false);
    } else if (!type.empty()) {
      std::vector<double> numbers;
      for (const auto& w : words(inline_values.child_value())) numbers.push_back(number(w, column.name));
      column.complex = complex || type.starts_with("A_COMPLEX");
      if (column.complex && numbers.size() % 2 != 0)
        fail(fmt::format("complex column '{}': Re and Im must come in pairs", column.name));
      column.value = as_column(numbers, column.complex);
    } else {
      file_.warnings.push_back(fmt::format("column '{}' has no values in this file", column.name));
    }
    file_.columns.push_back(std::move(column));
  }

  long field(const pugi::xml_node& part, const char* what, const std::string& column) const {
    const std::string text = part.child_value(what);
    const auto trimmed = words(text);
    if (trimmed.size() != 1)
      fail(fmt::format("binary column '{}': {} = '{}': must be one integer", column, what, text.substr(0, 40)));
    return whole(trimmed[0], what, column);
  }

  long whole(std::string_view word, const char* what, const std::string& column) const {
    if (const auto value = number_of<long>(word); value && *value >= 0) return *value;
    fail(
        fmt::format("binary column '{}': {} = '{}': must be a non-negative integer", column, what, word.substr(0, 40)));
  }

  std::vector<double> read_component(const pugi::xml_node& part, const std::string& column) {
    const std::string identifier = part.child_value("identifier");
    const auto found = binary_name_.find(identifier);
    if (found == binary_name_.end())
      fail(fmt::format("binary column '{}': no file is listed for '{}'", column, identifier));
    auto bytes = binary_.find(found->second);
    if (bytes == binary_.end()) bytes = binary_.emplace(found->second, components_(found->second)).first;
    const std::string& data = bytes->second;

    std::string type = part.child_value("datatype");
    bool big = false;
    if (type.ends_with("_beo")) {
      big = true;
      type.resize(type.size() - 4);
    }
    const auto* const known = std::ranges::find(kAtfxTypes, type, &std::pair<std::string_view, NumberType>::first);
    if (known == std::end(kAtfxTypes))
      fail(fmt::format("binary column '{}': data type '{}' cannot be read", column, type));
    const std::size_t width = width_of(known->second);
    const auto length = static_cast<std::size_t>(field(part, "length", column));
    const auto start = static_cast<std::size_t>(field(part, "inioffset", column));
    const auto per_block =
        static_cast<std::size_t>(*part.child_value("valperblock") != '\0' ? field(part, "valperblock", column) : 1);
    const auto block =
        static_cast<std::size_t>(*part.child_value("blocksize") != '\0' ? field(part, "blocksize", column) : 0);
    std::vector<std::size_t> offsets;
    for (const auto& w : words(part.child_value("valoffsets")))
      offsets.push_back(static_cast<std::size_t>(whole(w, "valoffsets", column)));
    if (offsets.empty()) offsets.push_back(0);
    if (per_block < 1 || per_block > (1u << 20))
      fail(fmt::format("binary column '{}': {} values per block", column, per_block));
    // One offset for several values: they follow each other.
    while (offsets.size() < per_block) offsets.push_back(offsets.back() + width);
    const std::size_t stride = block > 0 ? block : per_block * width;
    if (stride == 0 || start > data.size() || stride > data.size() + 1) {
      if (length > 0)
        fail(fmt::format("binary column '{}': block of {} bytes at {} lies outside '{}' ({} bytes)", column, stride,
                         start, found->second, data.size()));
    }
    if (length > data.size())
      fail(fmt::format("binary column '{}': {} values do not fit into the {} bytes of '{}'", column, length,
                       data.size(), found->second));

    std::vector<double> numbers;
    numbers.reserve(length);
    for (std::size_t n = 0; n < length; ++n) {
      const std::size_t at = start + n / per_block * stride + offsets[n % per_block];
      if (at > data.size() || data.size() - at < width) {
        fail(fmt::format("binary column '{}': value {} of {} lies beyond the end of '{}' ({} bytes)", column, n + 1,
                         length, found->second, data.size()));
      }
      numbers_into(&numbers.emplace_back(), 1, std::string_view(data).substr(at), width, 0, known->second, big);
    }
    return numbers;
  }

  // Implicit columns are as long as the stored ones of their table, or as the table says.
  void fill_implicit() {
    std::map<long, Eigen::Index> stored;
    for (const auto& column : file_.columns) {
      if (!column.implicit) stored[column.submatrix] = std::max(stored[column.submatrix], column.size());
    }
    for (const auto& implicit : implicit_) keep_going([&] { fill(implicit, stored); });
  }

  void fill(const Implicit& implicit, std::map<long, Eigen::Index>& stored) {
    AtfxColumn& column = file_.columns[implicit.column];
    Eigen::Index rows = stored[column.submatrix];
    const auto declared = words(rows_[implicit.table]);
    if (rows == 0 && !declared.empty()) {
      const double count = number(declared[0], column.name);
      implicit_rows_ += count;
      if (!(count >= 0 && implicit_rows_ <= kMostImplicitRows)) {
        fail(fmt::format("implicit column '{}': {} rows: must be 0 to {}, in all implicit columns without a stored one",
                         column.name, declared[0], kMostImplicitRows));
      }
      rows = static_cast<Eigen::Index>(count);
    }
    if (!implicit.text.empty()) {
      column.text.assign(static_cast<std::size_t>(rows), implicit.text);
    } else {
      column.value.resize(rows);
      for (Eigen::Index i = 0; i < rows; ++i) column.value[i] = implicit.start + implicit.step * static_cast<double>(i);
    }
  }

  std::string name_;
  const AtfxComponents& components_;
  pugi::xml_document document_;
  pugi::xml_node root_;
  AtfxFile file_;
  std::map<std::string, AtfxElement> elements_;
  std::map<std::string, std::string> unit_name_, unit_of_quantity_, rows_, binary_name_, binary_;
  std::map<std::string, pugi::xml_node> quantities_;
  std::vector<Implicit> implicit_;
  std::vector<std::string> problems_;
  double implicit_rows_ = 0;
};

}  // namespace

AtfxFile parse_atfx(std::string_view bytes, std::string_view name, const AtfxComponents& components) {
  return AtfxReader(bytes, name, components).read();
}

AtfxFile read_atfx(const std::filesystem::path& path) {
  return parse_atfx(read_text(path), path.string(), [&](const std::string& file) {
    const std::filesystem::path named(file), part = path.parent_path() / named;
    // No other file of this machine: whoever made this one would choose which.
    if (named.is_absolute() || std::find(named.begin(), named.end(), "..") != named.end())
      throw Error::in_file(path.string(), 0,
                           fmt::format("its binary part '{}' must be beside it or below", one_line(file)));
    if (!std::filesystem::exists(part)) {
      throw Error::in_file(path.string(), 0, fmt::format("its binary part '{}' is missing beside it", file));
    }
    return read_text(part);
  });
}

SignalFile signals_from_atfx(const AtfxFile& file) {
  SignalFile result;
  result.source = file.source;
  result.format = "ATFX";
  result.findings = file.warnings;
  std::map<long, const AtfxColumn*> axes;
  for (const auto& column : file.columns) {
    const UnitSuffix* unit = unit_from_label(column.unit);
    const bool axis = column.independent && column.text.empty() && !column.complex && unit != nullptr &&
                      (unit->quantity == Quantity::time || unit->quantity == Quantity::frequency);
    if (axis) axes.emplace(column.submatrix, &column);
  }
  std::size_t texts = 0;
  for (const auto& column : file.columns) {
    const auto axis = axes.find(column.submatrix);
    if (!column.text.empty()) ++texts;
    if (column.value.size() == 0 || (axis != axes.end() && axis->second == &column)) continue;
    SignalTable table;
    table.name = std::to_string(column.submatrix);
    if (axis != axes.end() && axis->second->size() == column.size()) {
      const UnitSuffix& unit = *unit_from_label(axis->second->unit);
      set_abscissa(table, unit.quantity, axis->second->value.real().unaryExpr([&](double v) { return unit.to_si(v); }));
    }
    Signal signal = make_signal(column.name, column.unit.empty() ? "-" : column.unit, column.value.real());
    if (column.complex) {
      const double scale = signal.quantity ? unit_from_label(signal.unit)->to_si(1) : 1;
      signal.imaginary = scale * column.value.imag();
    }
    if (!signal.quantity)
      result.findings.push_back(fmt::format("column '{}' has the unknown unit '{}'", column.name, column.unit));
    add_signal(result, table, std::move(signal));
  }
  if (texts > 0) result.contents.push_back(counted(texts, "column") + " of text");
  return result;
}

Format atfx_format() {
  Format f{FileFormat::atfx, "ATFX", {".atfx"}, [](std::string_view head) {
             const std::string_view text = without_blanks(head);
             return text.starts_with("<?xml") || text.starts_with("<atfx_file");
           }};
  f.read = [](const std::filesystem::path& path, const CsvOptions&) { return signals_from_atfx(read_atfx(path)); };
  return f;
}

}  // namespace whirl::io
