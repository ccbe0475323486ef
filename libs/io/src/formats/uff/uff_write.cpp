#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::io {
namespace {

// At most `width` characters, without cutting a UTF-8 character, and no line ends.
std::string cut(std::string text, std::size_t width) {
  for (auto& c : text) {
    if (c == '\n' || c == '\r') c = ' ';
  }
  if (text.size() > width) {
    std::size_t end = width;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text.resize(end);
  }
  // A line that reads -1 closes a block for many readers.
  return text == "-1" ? "'-1'" : text;
}

// A text field of exactly `width` bytes: columns count bytes, not the characters that fmt pads.
std::string field(const std::string& text, std::size_t width) {
  std::string out = cut(text, width);
  out.resize(width, ' ');
  return out;
}

std::string id_line(const std::string& text) { return (text.empty() ? std::string("NONE") : cut(text, 80)) + "\n"; }

// E13.5 and E20.12 with three-digit exponents where needed (the column grows by one then, never without a blank
// before).
std::string number(double value, bool single) {
  return single ? fmt::format(" {:12.5E}", value) : fmt::format(" {:19.12E}", value);
}

void numbers(std::string& out, const std::vector<double>& values, bool single) {
  const std::size_t per_line = single ? 6 : 4;
  for (std::size_t i = 0; i < values.size(); ++i) {
    out += number(values[i], single);
    if ((i + 1) % per_line == 0 || i + 1 == values.size()) out += '\n';
  }
}

std::string labels(const std::vector<long>& nodes) {
  std::string out;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    out += fmt::format("{:10d}", nodes[i]);
    if ((i + 1) % 8 == 0 || i + 1 == nodes.size()) out += '\n';
  }
  return out;
}

std::string axis(const UffAxis& a) {
  return fmt::format("{:10d}{:5d}{:5d}{:5d} {} {}\n", a.type, 0, 0, 0, field(a.label.empty() ? "NONE" : a.label, 20),
                     field(a.unit.empty() ? "NONE" : a.unit, 20));
}

std::string block(int dataset, const std::string& body) {
  return fmt::format("    -1\n{:6d}\n{}    -1\n", dataset, body);
}

// The header holds six digits. Where these are not all, the fifth ID line states start and step in full.
std::string exact_abscissa(const UffFunction& f) {
  const auto rounded = [](double v) { return std::strtod(fmt::format("{:13.5E}", v).c_str(), nullptr); };
  if (!f.even || (rounded(f.x0) == f.x0 && rounded(f.dx) == f.dx)) return {};
  return fmt::format("abscissa start {:.17g} step {:.17g}", f.x0, f.dx);
}

/// The fourth ID line, where nothing else stands in it, states the number of functions: a file that is cut off between
/// two would be a sound one of fewer.
std::string function_body(const UffFunction& f, std::size_t number, std::size_t count) {
  std::string out;
  const std::string exact = exact_abscissa(f);
  for (std::size_t i = 0; i < f.id.size(); ++i) {
    const bool free = f.id[i].empty() || f.id[i] == "NONE";
    out += id_line(i == 4 && !exact.empty() ? exact
                   : i == 3 && free         ? fmt::format("function {} of {}", number, count)
                                            : f.id[i]);
  }
  out += fmt::format("{:5d}{:10d}{:5d}{:10d} {}{:10d}{:4d} {}{:10d}{:4d}\n", f.type, 0, 0, 0,
                     field(f.response.name, 10), f.response.node, f.response.direction, field(f.reference.name, 10),
                     f.reference.node, f.reference.direction);
  const int ordinate = f.complex ? (f.single ? 5 : 6) : (f.single ? 2 : 4);
  out += fmt::format("{:10d}{:10d}{:10d}{:13.5E}{:13.5E}{:13.5E}\n", ordinate, f.value.size(), f.even ? 1 : 0, f.x0,
                     f.dx, 0.0);
  out += axis(f.abscissa) + axis(f.ordinate) + axis(f.denominator) + axis(f.z);
  std::vector<double> values;
  for (Eigen::Index i = 0; i < f.value.size(); ++i) {
    if (!f.even) values.push_back(f.x[i]);
    values.push_back(f.value[i].real());
    if (f.complex) values.push_back(f.value[i].imag());
  }
  numbers(out, values, f.single);
  return out;
}

std::string shape_body(const UffShape& s) {
  std::string out;
  for (const auto& id : s.id) out += id_line(id);
  out += fmt::format("{:10d}{:10d}{:10d}{:10d}{:10d}{:10d}\n", 1, s.analysis, s.characteristic, s.specific,
                     s.complex ? 5 : 2, s.value.cols());
  std::vector<long> integers{static_cast<long>(s.integers.size()), static_cast<long>(s.reals.size())};
  integers.insert(integers.end(), s.integers.begin(), s.integers.end());
  for (std::size_t i = 0; i < integers.size(); ++i) {
    out += fmt::format("{:10d}", integers[i]);
    if ((i + 1) % 8 == 0 || i + 1 == integers.size()) out += '\n';
  }
  numbers(out, s.reals, true);
  for (std::size_t n = 0; n < s.nodes.size(); ++n) {
    out += fmt::format("{:10d}\n", s.nodes[n]);
    std::vector<double> values;
    for (Eigen::Index k = 0; k < s.value.cols(); ++k) {
      values.push_back(s.value(static_cast<Eigen::Index>(n), k).real());
      if (s.complex) values.push_back(s.value(static_cast<Eigen::Index>(n), k).imag());
    }
    numbers(out, values, true);
  }
  return out;
}

}  // namespace

std::string format_uff(const UffFile& file) {
  std::string out;
  if (!file.header.empty()) {
    std::string body;
    for (const auto& line : file.header) body += cut(line, 80) + "\n";
    out += block(151, body);
  }
  for (const auto& u : file.units) {
    std::string body = fmt::format("{:10d}{}{:10d}\n", u.code, field(u.description, 20), 2);
    for (double factor : {u.length, u.force, u.temperature}) body += fmt::format("{:25.17E}", factor);
    out += block(164, body + fmt::format("\n{:25.17E}\n", u.temperature_offset));
  }
  if (!file.nodes.empty()) {
    std::string body;
    for (const auto& n : file.nodes) {
      body += fmt::format("{:10d}{:10d}{:10d}{:10d}{:13.5E}{:13.5E}{:13.5E}\n", n.label, 0, 0, 1, n.position[0],
                          n.position[1], n.position[2]);
    }
    out += block(15, body);
  }
  long index = 0;
  for (const auto& t : file.traces) {
    std::string body = fmt::format("{:10d}{:10d}{:10d}\n", ++index, t.nodes.size(), 1) + id_line(t.id);
    out += block(82, body + labels(t.nodes));
  }
  if (!file.elements.empty()) {
    std::string body;
    for (const UffElement& e : file.elements) {
      body += fmt::format("{:10d}{:10d}{:10d}{:10d}{:10d}{:10d}\n", e.label, e.type, 1, 1, 1, e.nodes.size());
      if (e.type == 11 || (e.type >= 21 && e.type <= 24)) body += fmt::format("{:10d}{:10d}{:10d}\n", 0, 1, 1);
      body += labels(e.nodes);
    }
    out += block(2412, body);
  }
  for (const auto& s : file.shapes) out += block(55, shape_body(s));
  for (std::size_t i = 0; i < file.functions.size(); ++i)
    out += block(58, function_body(file.functions[i], i + 1, file.functions.size()));
  return out;
}

void write_uff(const std::filesystem::path& path, const UffFile& file) {
  write_text(path, format_uff(file));
  for (const UffFunction& f : file.functions) {
    if (exact_abscissa(f).empty()) continue;
    remark(path.string(), fmt::format("the format holds six digits of start and step: {:.17g} and {:.17g} are beside "
                                      "them in the fifth ID line, which other programs may not look at",
                                      f.x0, f.dx));
    break;
  }
}

}  // namespace whirl::io
