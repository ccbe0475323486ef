#include "whirl/report/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "whirl/core/error.hpp"
#include "whirl/report/format.hpp"

namespace whirl::report {
namespace {

void check(const Table& table, std::size_t cells) {
  if (cells != table.columns.size()) {
    throw Error(fmt::format("table '{}': row has {} cells, the table has {} columns", table.caption, cells,
                            table.columns.size()));
  }
}

std::string_view css(Align align) { return align == Align::left ? "l" : align == Align::right ? "r" : "c"; }

std::string header(const Column& column) {
  return column.unit.empty() ? column.header : column.header + " [" + pretty_unit(column.unit) + "]";
}

std::string pad(const std::string& text, std::size_t width, Align align) {
  const std::size_t used = display_width(text);
  const std::size_t space = width > used ? width - used : 0;
  const std::size_t before = align == Align::left ? 0 : align == Align::right ? space : space / 2;
  return std::string(before, ' ') + text + std::string(space - before, ' ');
}

}  // namespace

void Table::add(std::vector<std::string> cells) {
  check(*this, cells.size());
  rows.push_back(std::move(cells));
}

std::string to_html(const Table& table) {
  std::string out = "<table>\n";
  if (!table.caption.empty()) out += "<caption>" + escape_markup(table.caption) + "</caption>\n";
  out += "<thead><tr>";
  for (const Column& column : table.columns) {
    out += fmt::format("<th scope=\"col\" class=\"{}\">{}", css(column.align), escape_markup(column.header));
    if (!column.unit.empty())
      out += fmt::format(" <span class=\"unit\">[{}]</span>", escape_markup(pretty_unit(column.unit)));
    out += "</th>";
  }
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    check(table, row.size());
    out += "<tr>";
    for (std::size_t c = 0; c < row.size(); ++c) {
      const bool head = c == 0 && table.row_headers;
      out += fmt::format("<{0}{1} class=\"{2}\">{3}</{0}>", head ? "th" : "td", head ? " scope=\"row\"" : "",
                         css(table.columns[c].align), escape_markup(row[c]));
    }
    out += "</tr>\n";
  }
  out += "</tbody>\n</table>\n";
  for (const std::string& note : table.notes) out += "<p class=\"note\">" + escape_markup(note) + "</p>\n";
  return out;
}

std::string to_text(const Table& table) {
  std::vector<std::size_t> widths;
  for (const Column& column : table.columns) widths.push_back(display_width(header(column)));
  for (const auto& row : table.rows) {
    check(table, row.size());
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], display_width(row[c]));
  }
  std::string out;
  if (!table.caption.empty()) out += table.caption + "\n";
  const auto append = [&](const auto& text_of) {
    std::string line;
    for (std::size_t c = 0; c < widths.size(); ++c) {
      line += (c == 0 ? "" : "  ") + pad(text_of(c), widths[c], table.columns[c].align);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  };
  append([&](std::size_t c) { return header(table.columns[c]); });
  std::string rule;
  for (std::size_t c = 0; c < widths.size(); ++c) {
    if (c > 0) rule += "  ";
    for (std::size_t k = 0; k < widths[c]; ++k) rule += "─";
  }
  out += rule + "\n";
  for (const auto& row : table.rows) append([&](std::size_t c) { return row[c]; });
  for (const std::string& note : table.notes) out += note + "\n";
  return out;
}

std::string to_csv(const Table& table) {
  std::string out;
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    out += (c == 0 ? "" : ",") + escape_csv(header(table.columns[c]));
  out += '\n';
  for (const auto& row : table.rows) {
    check(table, row.size());
    for (std::size_t c = 0; c < row.size(); ++c) out += (c == 0 ? "" : ",") + escape_csv(row[c]);
    out += '\n';
  }
  return out;
}

std::size_t display_width(std::string_view text) {
  std::size_t width = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<std::uint8_t>(text[i]);
    if ((byte & 0xC0) == 0x80) continue;
    // U+0300 to U+036F, the combining marks, start with the bytes CC or CD (up to AF); U+20D0 to U+20F0 with E2 83.
    const auto next = i + 1 < text.size() ? static_cast<std::uint8_t>(text[i + 1]) : std::uint8_t{0};
    const bool combining = byte == 0xCC || (byte == 0xCD && next < 0xB0) || (byte == 0xE2 && next == 0x83);
    if (!combining) ++width;
  }
  return width;
}

}  // namespace whirl::report
