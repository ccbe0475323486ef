// A complex array that stands in a file as two real ones.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/arrays/arrays.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

struct Words {
  std::string_view first, second;
  bool polar;
};
// Single letters only behind an underscore or a point.
constexpr Words kWords[] = {
    {"real", "imaginary", false}, {"real", "imag", false}, {"re", "im", false},          {"r", "i", false},
    {"magnitude", "phase", true}, {"mag", "phase", true},  {"mag", "ph", true},          {"abs", "angle", true},
    {"abs", "phase", true},       {"abs", "arg", true},    {"amplitude", "phase", true}, {"amp", "phase", true},
    {"mag", "angle", true},       {"mag", "ang", true},    {"abs", "ang", true}};

bool same_shape(const NamedArray& a, const NamedArray& b) {
  return a.value.rows() == b.value.rows() && a.value.cols() == b.value.cols() && a.sizes == b.sizes;
}

bool has_length(const NamedArray& a, const std::vector<Eigen::Index>& lines) {
  return std::any_of(lines.begin(), lines.end(), [&](Eigen::Index n) {
    return a.is_cube() ? std::find(a.sizes.begin(), a.sizes.end(), n) != a.sizes.end()
                       : a.value.rows() == n || a.value.cols() == n;
  });
}

// What is left of the name `whole` without `word` at its end (`behind`) or start; nothing when it is not there.
std::optional<std::string> without(const std::string& whole, std::string_view word, bool behind) {
  if (whole == word) return "";
  if (whole.size() <= word.size()) return {};
  const std::string base = behind ? whole.substr(0, whole.size() - word.size()) : whole.substr(word.size());
  if (!(behind ? whole.ends_with(word) : whole.starts_with(word))) return {};
  const char next = behind ? base.back() : base.front();
  const bool cut = next == '_' || next == '.' || next == ' ' || next == '-' || next == '(';
  if (!cut && word.size() == 1) return {};
  return base;
}

std::string trimmed(std::string name) {
  const auto edge = [](char c) { return c == '_' || c == '.' || c == ' ' || c == '-' || c == '(' || c == ')'; };
  while (!name.empty() && edge(name.back())) name.pop_back();
  while (!name.empty() && edge(name.front())) name.erase(name.begin());
  return name;
}

// The word of a name, where a bracket may close it: "H (re)".
std::string bare_word(const NamedArray& array) {
  std::string word = word_of(array);
  if (word.ends_with(')') && word.find('(') != std::string::npos) word.pop_back();
  return word;
}

struct Join {
  std::string base;
  bool polar;
};

std::optional<Join> join_of(const NamedArray& a, const NamedArray& b) {
  const std::string first = bare_word(a), second = bare_word(b);
  for (const Words& words : kWords) {
    for (const bool behind : {true, false}) {
      const auto one = without(first, words.first, behind), two = without(second, words.second, behind);
      if (!one || !two || *one != *two) continue;
      const std::string name = split_unit(a.name).unit != nullptr ? split_unit(a.name).name : a.name;
      const std::string base =
          trimmed(behind ? name.substr(0, one->size()) : name.substr(std::min(name.size(), words.first.size())));
      return Join{base, words.polar};
    }
  }
  return {};
}

// Magnitude and phase in SI and radians; false when the phase states no unit.
bool to_parts(NamedArray& magnitude, const NamedArray& phase) {
  const Signal angle = make_signal(phase.name, phase.unit, phase.value.reshaped());
  if (angle.quantity != Quantity::angle) return false;
  const Signal size = make_signal(magnitude.name, magnitude.unit, magnitude.value.reshaped());
  magnitude.unit = size.quantity == Quantity::dimensionless ? "" : size.unit;  // dB: converted here
  const Eigen::VectorXd given = magnitude.value.reshaped();
  const Eigen::ArrayXd absolute = size.quantity == Quantity::dimensionless ? size.value.array() : given.array();
  const Eigen::Index rows = magnitude.value.rows(), columns = magnitude.value.cols();
  magnitude.imaginary = (absolute * angle.value.array().sin()).matrix().reshaped(rows, columns);
  magnitude.value = (absolute * angle.value.array().cos()).matrix().reshaped(rows, columns);
  return true;
}

}  // namespace

void join_parts(SignalFile& file, std::vector<NamedArray>& arrays, const std::vector<Eigen::Index>& lines,
                const ResponseOptions* wanted) {
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    NamedArray& a = arrays[i];
    if (a.imaginary.size() > 0 || !has_length(a, lines)) continue;
    for (std::size_t j = 0; j < arrays.size(); ++j) {
      const NamedArray& b = arrays[j];
      if (j == i || b.imaginary.size() > 0 || a.group != b.group || !same_shape(a, b)) continue;
      const std::optional<Join> join = join_of(a, b);
      if (!join) continue;
      const std::string both = fmt::format("'{}' and '{}'", a.name, b.name);
      if (join->polar && !to_parts(a, b)) {
        const std::string open =
            fmt::format("{} look like magnitude and phase, but the phase states no unit: call it {}_deg or {}_rad",
                        both, b.name, b.name);
        if (wanted != nullptr) throw Error::in_file(file.source, 0, open);
        file.findings.push_back(open);
        continue;
      }
      if (!join->polar) {
        const Signal re = make_signal(a.name, a.unit, {}), im = make_signal(b.name, b.unit, {});
        if (re.unit != im.unit) {
          const std::string differ =
              fmt::format("{} are parts of one array in different units, '{}' and '{}'", both, re.unit, im.unit);
          if (wanted != nullptr) throw Error::in_file(file.source, 0, differ);
          file.findings.push_back(differ);
          continue;
        }
        a.unit = re.unit;
        a.imaginary = b.value;
      }
      const std::size_t cut = a.group.find_last_of("./");
      a.name = !join->base.empty() ? join->base
               : a.group.empty()   ? std::string("H")
                                   : a.group.substr(cut == std::string::npos ? 0 : cut + 1);
      arrays.erase(arrays.begin() + static_cast<std::ptrdiff_t>(j));
      if (j < i) --i;
      break;
    }
  }
}

}  // namespace whirl::io
