#pragma once
#include <algorithm>
#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace whirl::io {

/// Lines of a text in memory, counted for messages. LF, CR LF and a missing last line end are all right.
class TextLines {
 public:
  TextLines(std::string_view bytes, std::string name) : bytes_(bytes), name_(std::move(name)) {}

  bool done() const { return at_ >= bytes_.size(); }
  std::size_t remaining() const { return bytes_.size() - at_; }
  std::string_view next();
  std::string_view peek() const;
  std::string_view rest() const { return bytes_.substr(std::min(at_, bytes_.size())); }
  /// Raw bytes, at most as many as there are.
  std::string_view take(std::size_t count);
  long line() const { return line_; }  ///< of the line last returned, from 1
  const std::string& name() const { return name_; }
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0;
  long line_ = 0;
};

std::string_view trim(std::string_view text);
/// The number that the whole text is, in the form of std::from_chars; the other one takes a + before it.
template <class T>
std::optional<T> number_of(std::string_view text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}
template <class T>
std::optional<T> signed_number_of(std::string_view text) {
  return number_of<T>(text.substr(text.starts_with('+') ? 1 : 0));
}
/// FACTOR of "HEADER:name_unit*FACTOR". Throws Error in the field --columns.
double factor_of(const std::string& column);
/// Trimmed text in UTF-8; what is no UTF-8 is taken for latin-1.
std::string text_of(std::string_view raw);
/// Columns [first, first + width), blanks trimmed; empty beyond the end.
std::string_view columns(std::string_view line, std::size_t first, std::size_t width);
/// An integer in columns; 0 when blank.
long integer(const TextLines& lines, std::string_view line, std::size_t first, std::size_t width);
/// Appends the numbers of a line: E or D exponents of any length, or a bare sign; no blank needed between.
void append_numbers(const TextLines& lines, std::string_view line, std::vector<double>& numbers);

}  // namespace whirl::io
