#include "formats/csv/csv_fields.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

#include "whirl/core/names.hpp"

namespace whirl::io::detail {

std::string_view trim_of(std::string_view text, std::string_view what) {
  const std::size_t first = text.find_first_not_of(what);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(what) - first + 1);
}

std::string_view unquote(std::string_view text) {
  text = trim_of(text, " ");
  if (text.size() >= 2 && text.front() == '"' && text.back() == '"') text = trim_of(text.substr(1, text.size() - 2));
  return text;
}

std::vector<std::string_view> split(std::string_view line, char delimiter) {
  std::vector<std::string_view> fields;
  bool quoted = false;
  std::size_t start = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i == line.size() || (line[i] == delimiter && !quoted)) {
      fields.push_back(line.substr(start, i - start));
      start = i + 1;
    } else if (line[i] == '"') {
      quoted = !quoted;
    }
  }
  return fields;
}

Parsed parse_number(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return Parsed::bad;
  }
  const auto [end, ec] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || ec == std::errc::invalid_argument) return Parsed::bad;
  if (ec == std::errc::result_out_of_range) {
    // from_chars does not tell overflow from underflow; a negative exponent means underflow, which is zero.
    const std::size_t e = text.find_first_of("eE");
    if (e == std::string_view::npos || text.substr(e + 1, 1) != "-") return Parsed::not_finite;
    value = 0;
  }
  return std::isfinite(value) ? Parsed::good : Parsed::not_finite;
}

bool is_missing(std::string_view text) {
  const std::string small = small_letters(text);
  return small.empty() || small == "nan" || small == "-nan" || small == "na" || small == "n/a" || small == "null" ||
         small == "over" || small == "ovld" || small == "overload" || small == "ol" || small == "---";
}

bool is_number(std::string_view text) {
  double value = 0;
  std::string copy(text);
  std::replace(copy.begin(), copy.end(), ',', '.');
  return parse_number(copy, value) != Parsed::bad;
}

char delimiter_of(std::string_view header, std::string_view ahead) {
  const bool quotes = std::ranges::count(header, '"') % 2 == 0;  // else one stands for inches
  for (const char c : {';', '\t', ','})
    if (quotes ? split(header, c).size() > 1 : header.find(c) != std::string_view::npos) return c;
  const auto words = [](std::string_view t) {
    std::vector<std::string_view> out;
    for (const std::string_view f : split(t, ' '))
      if (!trim_of(f, " \t\r").empty()) out.push_back(trim_of(f, " \t\r"));
    return out;
  };
  const auto names = words(header), values = words(ahead.substr(0, ahead.find('\n')));
  const bool numbers = std::all_of(values.begin(), values.end(), [](auto v) { return is_number(v); });
  return names.size() > 1 && names.size() == values.size() && numbers ? ' ' : ',';
}

}  // namespace whirl::io::detail
