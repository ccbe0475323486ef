#include "formats/uff/uff_binary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/arrays/bytes.hpp"

namespace whirl::io {
namespace {

/// True when the block ends after so many bytes of data: CR LF or nothing, then the line -1.
bool ends_after(const TextLines& lines, std::size_t bytes) {
  std::string_view rest = lines.rest();
  if (rest.size() < bytes) return false;
  rest.remove_prefix(bytes);
  for (int i = 0; i < 2 && !rest.empty() && (rest.front() == '\r' || rest.front() == '\n'); ++i) rest.remove_prefix(1);
  return is_delimiter(rest.substr(0, rest.find_first_of("\r\n")));
}

double binary_number(const TextLines& lines, std::string_view raw, std::size_t at, bool single, bool little,
                     std::size_t index) {
  const double number = single ? number_at<float>(raw, at, !little) : number_at<double>(raw, at, !little);
  if (!std::isfinite(number))
    lines.fail(fmt::format("binary value {} is not finite: wrong byte order or damaged data", index + 1));
  return number;
}

std::vector<double> mixed_numbers(const TextLines& lines, std::string_view raw, bool little, std::size_t per_value) {
  std::vector<double> numbers;
  for (std::size_t at = 0; at < raw.size();) {
    const bool abscissa = numbers.size() % per_value == 0;
    numbers.push_back(binary_number(lines, raw, at, abscissa, little, numbers.size()));
    at += abscissa ? 4 : 8;
  }
  return numbers;
}

}  // namespace

std::vector<double> binary_numbers(TextLines& lines, const UffBinary& form, const UffFunction& f, std::size_t per_value,
                                   std::vector<std::string>& warnings) {
  const std::size_t width = f.single ? 4 : 8;
  const std::size_t wanted = static_cast<std::size_t>(f.declared) * per_value;
  // Uneven abscissae may be single beside double ordinates, as the text form has them.
  if (!f.even && !f.single && form.bytes == wanted * width - 4 * static_cast<std::size_t>(f.declared) &&
      lines.rest().size() >= form.bytes)
    return mixed_numbers(lines, lines.take(form.bytes), form.little, per_value);
  // Some writers count values instead of bytes, or a complex value once: where the block ends decides.
  const bool miscounted =
      form.bytes != wanted * width && !ends_after(lines, form.bytes) && ends_after(lines, wanted * width);
  if (miscounted) {
    warnings.push_back(
        fmt::format("line {}: the header states {} bytes of data, {} values of {} bytes follow: all were read",
                    lines.line(), form.bytes, wanted, width));
  }
  const std::string_view raw = lines.take(miscounted ? wanted * width : form.bytes);
  const std::size_t count = std::min(wanted, raw.size() / width);
  if (!miscounted && form.bytes != wanted * width && raw.size() == form.bytes) {
    warnings.push_back(
        fmt::format("line {}: {} bytes of data for {} values of {} bytes", lines.line(), form.bytes, wanted, width));
  }
  std::vector<double> numbers(count);
  for (std::size_t i = 0; i < count; ++i) numbers[i] = binary_number(lines, raw, i * width, f.single, form.little, i);
  return numbers;
}

}  // namespace whirl::io
