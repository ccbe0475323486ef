#include "whirl/identify/rotor_angle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/signal/motion_quantity.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::identification {
namespace {

/// Whether a name says that the channel reads along `axis`: a word of it is that letter, alone or beside what it
/// measures.
bool reads_along(const std::string& name, char axis) {
  constexpr std::array<std::string_view, 10> kinds{"",    "a",        "acc", "accel", "acceleration",
                                                   "vel", "velocity", "v",   "vib",   "vibration"};
  const auto is_axis = [&](std::string_view word) {
    const auto known = [&](std::string_view rest) { return std::ranges::find(kinds, rest) != kinds.end(); };
    return !word.empty() && ((word.front() == axis && known(word.substr(1))) ||
                             (word.back() == axis && known(word.substr(0, word.size() - 1))));
  };
  std::string word;
  for (const char c : name + " ") {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else {
      if (is_axis(word)) return true;
      word.clear();
    }
  }
  return false;
}

}  // namespace

Recording with_motion_names(Recording record) {
  if (record.has("x") || record.has("y")) return record;
  std::array<Channel*, 2> found{};
  std::vector<Channel*> all;
  for (Channel& c : record.channels) {
    const std::optional<int> order = signal::integrations(c.quantity, Quantity::displacement);
    if (!order) continue;
    if (*order == 0) return record;
    all.push_back(&c);
    for (const std::size_t k : {0U, 1U}) {
      if (!reads_along(c.name, k == 0 ? 'x' : 'y')) continue;
      if (found[k] != nullptr)
        throw Error(fmt::format("{}: '{}' and '{}' may be {}: name the one, --columns \"{}:{}\"", record.source,
                                found[k]->name, c.name, k == 0 ? "x" : "y", c.name, k == 0 ? "x" : "y"));
      found[k] = &c;
    }
  }
  if (all.size() == 1 && found[1] == nullptr) found[0] = all.front();
  for (const std::size_t k : {0U, 1U}) {
    if (found[k] == nullptr) continue;
    const std::string axis = k == 0 ? "x" : "y";
    io::remark(record.source,
               fmt::format("'{}' is taken for {}, {}", found[k]->name, axis, to_string(found[k]->quantity)));
    found[k]->name = axis;
  }
  return record;
}

Recording with_angle_from_pulses(const Recording& record, const std::string& pulses,
                                 const signal::TachoOptions& tacho) {
  std::vector<std::string> said;
  Recording out = signal::with_tacho_angle(record, pulses, tacho, said);
  for (const std::string& text : said) io::remark(record.source, text);
  return out;
}

}  // namespace whirl::identification
