#include "formats/uff/uff_points.hpp"

#include <array>
#include <optional>
#include <vector>

#include "formats/text_lines.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kPointWords = 10, kNameEnds[] = {40, 65};  // the last column of each name, from 0

// A name runs over its last column, or a number behind one is none.
bool leaves_columns(std::string_view line) {
  for (const std::size_t end : kNameEnds) {
    if (line.size() > end + 1 && line[end] != ' ' && line[end + 1] != ' ') return true;
    for (const auto& [first, width] : {std::pair<std::size_t, std::size_t>{end + 1, 10}, {end + 11, 4}}) {
      const std::string_view word = columns(line, first, width);
      if (!word.empty() && !signed_number_of<long>(word)) return true;
    }
  }
  return false;
}

}  // namespace

bool read_points_by_blanks(std::string_view line, UffFunction& f) {
  if (!leaves_columns(line)) return false;
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(' '); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find(' ', at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(' ', end);
  }
  if (words.size() != kPointWords) return false;
  std::array<long, kPointWords> number{};
  for (std::size_t k = 0; k < kPointWords; ++k) {
    if (k == 4 || k == 7) continue;
    const std::optional<long> value = signed_number_of<long>(words[k]);
    if (!value || *value < -99999999 || *value > 999999999) return false;
    number[k] = *value;
  }
  f.type = static_cast<int>(number[0]);
  f.response = {text_of(words[4]), number[5], static_cast<int>(number[6])};
  f.reference = {text_of(words[7]), number[8], static_cast<int>(number[9])};
  return true;
}

}  // namespace whirl::io
