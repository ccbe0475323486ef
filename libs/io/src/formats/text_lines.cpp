#include "formats/text_lines.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::io {

std::string_view TextLines::next() {
  const std::string_view line = peek();
  at_ = std::min(bytes_.size(), at_ + line.size());
  if (at_ < bytes_.size() && bytes_[at_] == '\r') ++at_;
  if (at_ < bytes_.size() && bytes_[at_] == '\n') ++at_;
  ++line_;
  return line;
}

std::string_view TextLines::peek() const {
  std::size_t end = bytes_.find('\n', at_);
  if (end == std::string_view::npos) end = bytes_.size();
  if (end > at_ && bytes_[end - 1] == '\r') --end;
  return bytes_.substr(at_, end - at_);
}

std::string_view TextLines::take(std::size_t count) {
  const std::string_view raw = bytes_.substr(at_, count);
  at_ += raw.size();
  return raw;
}

void TextLines::fail(const std::string& message) const { throw Error::in_file(name_, line_, message); }

std::string_view trim(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\0'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string_view columns(std::string_view line, std::size_t first, std::size_t width) {
  return first < line.size() ? trim(line.substr(first, width)) : std::string_view{};
}

long integer(const TextLines& lines, std::string_view line, std::size_t first, std::size_t width) {
  const std::string_view text = columns(line, first, width);
  const std::optional<long> value = text.empty() ? 0 : signed_number_of<long>(text);
  if (value) return *value;
  lines.fail(fmt::format("'{}' in columns {} to {}: must be an integer", text.substr(text.front() == '+' ? 1 : 0),
                         first + 1, first + width));
}

double factor_of(const std::string& column) {
  const auto factor = number_of<double>(std::string_view(column).substr(column.rfind('*') + 1));
  if (factor && std::isfinite(*factor) && *factor != 0) return *factor;
  throw Error::in_field("--columns", column, "HEADER:name_unit*FACTOR with a number that is not zero");
}

void append_numbers(const TextLines& lines, std::string_view line, std::vector<double>& numbers) {
  const auto digit = [&](std::size_t i) {
    return i < line.size() && std::isdigit(static_cast<unsigned char>(line[i]));
  };
  const auto sign = [&](std::size_t i) { return i < line.size() && (line[i] == '+' || line[i] == '-'); };
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && (line[i] == ' ' || line[i] == '\t')) ++i;
    if (i >= line.size()) return;
    const std::size_t start = i;
    std::string text;
    if (sign(i)) {
      if (line[i] == '-') text += '-';
      ++i;
    }
    const std::size_t mantissa = i;
    bool point = false;
    while (digit(i) || (i < line.size() && line[i] == '.' && !point)) {
      point |= line[i] == '.';
      text += line[i++];
    }
    bool good = i > mantissa + (point ? 1 : 0);
    const char letter = i < line.size() ? line[i] : ' ';
    std::size_t exponent = i;
    if (letter == 'E' || letter == 'e' || letter == 'D' || letter == 'd') {
      exponent = i + 1;
      good = good && (digit(exponent) || (sign(exponent) && digit(exponent + 1)));
    } else if (point && sign(i) && digit(i + 1)) {
      // Fortran drops the letter of a three-digit exponent. The next number would have its own decimal point.
      std::size_t end = i + 1;
      while (digit(end)) ++end;
      if (end - i == 4 && !(end < line.size() && line[end] == '.')) {
        exponent = i;
      } else {
        exponent = std::string_view::npos;
      }
    } else {
      exponent = std::string_view::npos;
    }
    if (good && exponent != std::string_view::npos) {
      i = exponent;
      text += 'e';
      if (sign(i)) text += line[i++];
      for (int digits = 0; digit(i) && digits < 3; ++digits) text += line[i++];
    }
    double value = 0;
    if (good) {
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
      if (error == std::errc::result_out_of_range) {
        value = text.find("e-") != std::string::npos ? 0.0 : HUGE_VAL;
      } else {
        good = error == std::errc() && end == text.data() + text.size();
      }
    }
    if (!good || !std::isfinite(value)) {
      lines.fail(fmt::format("'{}' at column {}: must be a finite number", trim(line.substr(start, 20)), start + 1));
    }
    numbers.push_back(value);
  }
}

std::string text_of(std::string_view raw) {
  raw = trim(raw);
  bool utf8 = true;
  for (std::size_t i = 0; i < raw.size() && utf8; ++i) {
    const auto c = static_cast<unsigned char>(raw[i]);
    if (c < 0x80) continue;
    const std::size_t more = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : c >= 0xC2 ? 1 : 0;
    utf8 = more > 0 && i + more < raw.size();
    for (std::size_t k = 1; utf8 && k <= more; ++k) utf8 = (static_cast<unsigned char>(raw[i + k]) & 0xC0) == 0x80;
    i += more;
  }
  if (utf8) return std::string(raw);
  std::string converted;
  for (const char byte : raw) {
    const auto c = static_cast<unsigned char>(byte);
    if (c < 0x80) {
      converted += byte;
    } else {
      converted += static_cast<char>(0xC0 | (c >> 6));
      converted += static_cast<char>(0x80 | (c & 0x3F));
    }
  }
  return converted;
}

}  // namespace whirl::io
