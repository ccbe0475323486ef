#include "whirl/core/names.hpp"

#include <algorithm>
#include <iterator>

namespace whirl {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Takes one character of UTF-8 off the text; 0xfffd for a byte that begins none.
char32_t take_character(std::string_view& text) {
  constexpr char32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000}, kWrong = 0xfffd;
  const auto first = static_cast<unsigned char>(text.front());
  const std::size_t size = first < 0x80 ? 1 : first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : first >= 0xc2 ? 2 : 0;
  char32_t code = size == 1 ? first : size == 0 ? kWrong : first & (0xffU >> (size + 1));
  bool good = size > 0 && size <= text.size() && first < 0xf5;
  for (std::size_t i = 1; good && i < size; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    good = (next & 0xc0) == 0x80;
    code = code << 6 | (next & 0x3f);
  }
  good = good && code >= kSmallest[size] && code <= 0x10ffff && !(code >= 0xd800 && code <= 0xdfff);
  text.remove_prefix(good ? size : 1);
  return good ? code : kWrong;
}

/// Controls, line and paragraph ends, and what turns or hides the text that follows.
bool is_hidden(char32_t c) {
  return c < 0x20 || (c >= 0x7f && c < 0xa0) || (c >= 0x200b && c <= 0x200f) || (c >= 0x2028 && c <= 0x202e) ||
         (c >= 0x2060 && c <= 0x206f) || c == 0xfeff;
}

}  // namespace

bool is_identifier(std::string_view name) {
  const std::size_t stem = std::min(name.find('\''), name.size());
  const std::string_view primes = name.substr(stem), word = name.substr(0, stem);
  return !word.empty() && stem <= 128 && is_letter(word[0]) && primes.size() <= 8 &&
         std::all_of(word.begin(), word.end(), [](char c) { return is_letter(c) || is_digit(c); }) &&
         primes.find_first_not_of('\'') == std::string_view::npos;
}

bool is_left_side(std::string_view text) {
  if (text.ends_with("[k+1]")) text.remove_suffix(5);
  return is_identifier(text);
}

bool is_label(std::string_view text) { return text.size() <= 4096 && one_line(text) == text; }

bool is_unit_text(std::string_view text) {
  const auto allowed = [](char c) {
    return is_letter(c) || is_digit(c) || static_cast<unsigned char>(c) >= 0x80 ||
           std::string_view(" ^*/.-+%()").find(c) != std::string_view::npos;
  };
  const auto is_sign = [](char c) { return c == '*' || c == '/'; };
  return text.size() <= 100 && is_label(text) && std::all_of(text.begin(), text.end(), allowed) &&
         std::adjacent_find(text.begin(), text.end(), [&](char a, char b) { return is_sign(a) && is_sign(b); }) ==
             text.end();
}

std::string small_letters(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return small;
}

std::string channel_role(std::string_view name) {
  constexpr std::string_view kRoles[] = {"t",         "time",  "x",     "y",   "beta", "key",
                                         "keyphasor", "tacho", "speed", "rpm", "omega"};
  const std::string small = small_letters(name);
  return std::ranges::find(kRoles, small) != std::end(kRoles) ? small : std::string(name);
}

std::string one_line(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view before = text;
    const char32_t c = take_character(text);
    const std::string_view taken = before.substr(0, before.size() - text.size());
    if (c == 0xfffd && taken.size() == 1) {
      out += '?';
    } else if (is_hidden(c)) {
      out += ' ';
    } else {
      out += taken;
    }
  }
  return out;
}

}  // namespace whirl
