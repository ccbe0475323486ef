#include "formats/csv/csv_lines.hpp"

#include <fmt/format.h>

#include <cstring>

#include "formats/csv/csv_fields.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io::detail {
namespace {

constexpr std::size_t kLineBuffer = std::size_t{1} << 20;  // also the longest line

}  // namespace

void CsvLines::refill() {
  if (!buffer) buffer = std::make_unique_for_overwrite<char[]>(kLineBuffer);
  std::memmove(buffer.get(), buffer.get() + begin, end - begin);
  end -= begin;
  begin = 0;
  if (end == kLineBuffer)
    throw Error::in_file(source.name(), line + 1,
                         fmt::format("longer than {} bytes: this is no CSV file", kLineBuffer));
  const std::size_t n = source.read(buffer.get() + end, kLineBuffer - end);
  if (n < kLineBuffer - end) eof_ = true;
  end += n;
}

bool CsvLines::get_line(std::string_view& out) {
  const char* newline = nullptr;
  while (true) {
    newline = static_cast<const char*>(std::memchr(buffer.get() + begin, '\n', end - begin));
    if (newline || eof_) break;
    refill();
  }
  if (begin == end) return false;
  const char* first = buffer.get() + begin;
  const char* last = newline ? newline : buffer.get() + end;
  begin = newline ? static_cast<std::size_t>(newline - buffer.get()) + 1 : end;
  open_line = newline == nullptr;
  ++line;
  if (last > first && last[-1] == '\r') --last;
  out = {first, static_cast<std::size_t>(last - first)};
  if (blanks_between) {
    even_blanks_.clear();
    for (const char c : trim_of(out))
      if ((c != ' ' && c != '\t') || even_blanks_.back() != ' ') even_blanks_ += c == '\t' ? ' ' : c;
    out = even_blanks_;
  }
  return true;
}

}  // namespace whirl::io::detail
