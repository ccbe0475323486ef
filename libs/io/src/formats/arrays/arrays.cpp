#include "formats/arrays/arrays.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>
#include <span>

#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"

namespace whirl::io {
namespace {

struct Axes {
  SignalTable time, frequency;
  Eigen::Index times = -1, frequencies = -1;  ///< their lengths
  double step = 0;
};

bool is_vector(const NamedArray& array) {
  return array.imaginary.size() == 0 && !array.is_cube() && array.value.size() > 1 &&
         (array.value.rows() == 1 || array.value.cols() == 1);
}

constexpr std::string_view kTimes[] = {"t", "time", "times"};
constexpr std::string_view kFrequencies[] = {"freq",      "freqs",          "frequency", "frequencies",
                                             "freq_axis", "frequency_axis", "freqaxis",  "freq_vec",
                                             "freqvec",   "faxis",          "f_axis"};
constexpr std::string_view kAngular[] = {"w", "omega", "angular_frequency"};

bool is_one_of(std::string_view word, std::span<const std::string_view> words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

// A vector that may be an axis of frequencies: by a word, or by a letter where it ascends evenly.
bool may_be_frequencies(const NamedArray& array) {
  const std::string word = word_of(array);
  return is_vector(array) && (is_one_of(word, kFrequencies) || is_one_of(word, kAngular) || word == "f");
}

// Lines of the complex arrays: a vector of this length that is called f, w or omega is their axis and no force or
// speed.
std::set<Eigen::Index> complex_lengths(const std::vector<NamedArray>& arrays) {
  std::set<Eigen::Index> lengths;
  for (const NamedArray& array : arrays) {
    if (array.imaginary.size() == 0) continue;
    if (array.is_cube()) {
      lengths.insert(array.sizes.begin(), array.sizes.end());
    } else {
      lengths.insert({array.value.rows(), array.value.cols()});
    }
  }
  return lengths;
}

bool ascends_evenly(const Eigen::Map<const Eigen::VectorXd>& v) {
  if (v.size() < 3 || !(v[0] >= 0) || !(v[1] > v[0])) return false;
  const double step = (v[v.size() - 1] - v[0]) / static_cast<double>(v.size() - 1);
  for (Eigen::Index i = 1; i < v.size(); ++i)
    if (!(std::abs(v[i] - v[i - 1] - step) < 1e-3 * step)) return false;
  return true;
}

// In Hz. Without a unit of the file or of the user the name and the numbers decide, with a finding; where they
// contradict one another, or the numbers speak for rad/s alone, it is asked.
std::optional<Eigen::VectorXd> in_hertz(const NamedArray& array, const Signal& stated, bool angular, bool complex,
                                        const ResponseOptions* wanted, SignalFile& file) {
  const UnitSuffix* unit = nullptr;
  if (wanted != nullptr && !wanted->frequency_unit.empty()) {
    unit = find_unit(wanted->frequency_unit);
    const bool known =
        unit != nullptr && (unit->quantity == Quantity::frequency || unit->quantity == Quantity::angular_velocity);
    if (!known) throw Error::in_field("--frequency-unit", wanted->frequency_unit, "hz, kHz, rad_s or rpm");
    if (stated.quantity)
      throw Error::in_file(file.source, 0,
                           fmt::format("--frequency-unit: '{}' states its unit itself, {}", array.name, stated.unit));
  }
  const double turn = 2 * std::numbers::pi;
  if (stated.quantity == Quantity::frequency) return stated.value;
  if (stated.quantity == Quantity::angular_velocity) return stated.value / turn;
  if (stated.quantity) return {};
  if (unit != nullptr) {
    const Eigen::VectorXd si = stated.value.unaryExpr([unit](double v) { return unit->to_si(v); });
    return unit->quantity == Quantity::frequency ? si : Eigen::VectorXd(si / turn);
  }
  if (!angular && unit_by_numbers(stated.value) == AxisUnit::rad_s) {
    const Eigen::Index n = stated.value.size();
    const std::string open = fmt::format(
        "'{}' has no unit, and its step of {:.9g} looks like rad/s ({:.6g} Hz): state --frequency-unit rad_s or hz",
        array.name, (stated.value[n - 1] - stated.value[0]) / static_cast<double>(n - 1),
        (stated.value[n - 1] - stated.value[0]) / static_cast<double>(n - 1) / turn);
    if (wanted != nullptr && complex) throw Error::in_file(file.source, 0, open);
    file.findings.push_back(open);
    return {};
  }
  file.findings.push_back(fmt::format("'{}' has no unit: taken as {} (--frequency-unit states another)", array.name,
                                      angular ? "rad/s" : "Hz"));
  return angular ? Eigen::VectorXd(stated.value / turn) : stated.value;
}

bool take_frequencies(const NamedArray& array, const std::set<Eigen::Index>& complex, const ResponseOptions* wanted,
                      Axes& axes, SignalFile& file) {
  const std::string word = word_of(array);
  if (!may_be_frequencies(array)) return false;
  const bool long_word = is_one_of(word, kFrequencies), angular = is_one_of(word, kAngular);
  const Eigen::Map<const Eigen::VectorXd> values(array.value.data(), array.value.size());
  const bool lines = complex.contains(values.size());
  if (!long_word && (axes.frequencies > 0 || !lines || !ascends_evenly(values))) return false;
  const Signal stated = make_signal(array.name, array.unit, values);
  if (stated.quantity && *stated.quantity != Quantity::frequency && *stated.quantity != Quantity::angular_velocity)
    return false;
  axes.frequency = {};
  if (const auto hertz = in_hertz(array, stated, angular, lines, wanted, file))
    set_abscissa(axes.frequency, Quantity::frequency, *hertz);
  axes.frequencies = values.size();
  return true;
}

// True when the array is an axis of its group, which is then filled.
bool take_axis(const NamedArray& array, const std::set<Eigen::Index>& complex, const ResponseOptions* wanted,
               Axes& axes, SignalFile& file) {
  const std::string word = word_of(array);
  const double scalar = array.value.size() == 1 ? array.value(0, 0) : 0;
  if (scalar > 0 && (word == "dt" || word == "fs" || word == "rate" || word == "sample_rate" ||
                     word == "sampling_rate" || word == "samplerate")) {
    const Signal s = make_signal(array.name, array.unit, Eigen::VectorXd::Constant(1, scalar));
    axes.step = word == "dt" ? s.value[0] : 1 / s.value[0];
    return true;
  }
  if (take_frequencies(array, complex, wanted, axes, file)) return true;
  if (!is_vector(array) || !names_time(array)) return false;
  const Eigen::Map<const Eigen::VectorXd> values(array.value.data(), array.value.size());
  const Signal s = make_signal(array.name, array.unit, values);
  if (s.quantity && *s.quantity != Quantity::time) return false;
  if (!s.quantity) file.findings.push_back(fmt::format("'{}' has no unit: taken as s", array.name));
  PartOfAxis part{0, values.size(), values[0], values[values.size() - 1]};
  if (array.part) part = *array.part;
  const Signal ends = make_signal(array.name, array.unit, Eigen::Vector2d(part.head, part.tail));
  part.head = ends.value[0];
  part.tail = ends.value[1];
  set_abscissa(axes.time, Quantity::time, s.value, part);
  axes.times = values.size();
  return true;
}

// Of the group or, where it has none, of the nearest group about it.
const Axes& axes_of(const std::map<std::string, Axes>& groups, std::string group) {
  while (true) {
    const auto found = groups.find(group);
    if (found != groups.end() && (found->second.times > 0 || found->second.frequencies > 0 || found->second.step > 0))
      return found->second;
    if (group.empty()) {
      static const Axes none;
      return none;
    }
    const std::size_t cut = group.find_last_of("./");
    group.resize(cut == std::string::npos ? 0 : cut);
  }
}

// Channels side by side, one a column, as (lines, outer, inner): inner 0 of a matrix.
struct Columns {
  Eigen::MatrixXd real, imaginary;
  Eigen::Index inner = 0;
};

// The dimension along the axis: the one that is as long, else the longest; of several as long as the axis the first.
// `open` says that the file does not decide it.
std::size_t along(const std::vector<Eigen::Index>& sizes, const Axes& axes, bool& open) {
  std::size_t fitting = 0, first = sizes.size();
  for (std::size_t d = sizes.size(); d-- > 0;) {
    if (sizes[d] < 2 || (sizes[d] != axes.times && sizes[d] != axes.frequencies)) continue;
    ++fitting;
    first = d;
  }
  open = fitting > 1;
  return fitting > 0 ? first : static_cast<std::size_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
}

std::string in_words(const std::vector<Eigen::Index>& sizes) { return fmt::format("{}", fmt::join(sizes, " x ")); }

std::size_t lines_dimension(const NamedArray& array, const std::vector<Eigen::Index>& sizes, const Axes& axes,
                            const ResponseOptions* wanted, SignalFile& file) {
  if (array.part) return 0;
  bool open = false;
  const std::size_t found = along(sizes, axes, open);
  const bool response = array.imaginary.size() > 0 && sizes[found] == axes.frequencies;
  if (wanted != nullptr && wanted->lines_dimension > 0 && array.imaginary.size() > 0 && axes.frequencies > 0) {
    const auto stated = static_cast<std::size_t>(wanted->lines_dimension) - 1;
    if (stated >= sizes.size() || sizes[stated] != axes.frequencies)
      throw Error::in_file(file.source, 0,
                           fmt::format("--lines-dimension {}: '{}' is {}, and its frequencies are {}",
                                       wanted->lines_dimension, array.name, in_words(sizes), axes.frequencies));
    return stated;
  }
  if (!open) return found;
  const std::string which = fmt::format("'{}' is {}: which side runs along its {} {} is open", array.name,
                                        in_words(sizes), sizes[found], response ? "frequencies" : "times");
  if (wanted != nullptr && response)
    throw Error::in_file(file.source, 0, which + ": state --lines-dimension, counted from 1");
  file.findings.push_back(fmt::format("{}; shown along the {}", which,
                                      found == 0   ? "first"
                                      : found == 1 ? "second"
                                                   : "third"));
  return found;
}

Columns columns_of(const NamedArray& array, const Axes& axes, const ResponseOptions* wanted, SignalFile& file) {
  if (!array.is_cube()) {
    const std::size_t lines = lines_dimension(array, {array.value.rows(), array.value.cols()}, axes, wanted, file);
    const auto turned = [&](const Eigen::MatrixXd& m) { return lines == 0 ? m : Eigen::MatrixXd(m.transpose()); };
    return {turned(array.value), turned(array.imaginary), 0};
  }
  const auto& n = array.sizes;
  const std::size_t lines = lines_dimension(array, {n[0], n[1], n[2]}, axes, wanted, file);
  const std::size_t outer = lines == 0 ? 1 : 0, inner = lines == 2 ? 1 : 2;
  const auto arranged = [&](const Eigen::MatrixXd& v) {
    Eigen::MatrixXd m(v.size() > 0 ? n[lines] : 0, v.size() > 0 ? n[outer] * n[inner] : 0);
    Eigen::Index at = 0;
    std::array<Eigen::Index, 3> i{};
    for (i[2] = 0; i[2] < n[2] && v.size() > 0; ++i[2]) {
      for (i[1] = 0; i[1] < n[1]; ++i[1]) {
        for (i[0] = 0; i[0] < n[0]; ++i[0]) m(i[lines], i[outer] * n[inner] + i[inner]) = v(at++, 0);
      }
    }
    return m;
  };
  return {arranged(array.value), arranged(array.imaginary), n[inner]};
}

void add_array(SignalFile& file, const NamedArray& array, const Axes& axes, const ResponseOptions* wanted) {
  const Columns columns = columns_of(array, axes, wanted, file);
  const Eigen::Index length = columns.real.rows();
  SignalTable table;
  // Complex numbers are rather lines of a spectrum than samples.
  const bool spectrum = array.imaginary.size() > 0 && length == axes.frequencies;
  if (length == axes.times && !spectrum) {
    table = axes.time;
  } else if (length == axes.frequencies) {
    table = axes.frequency;
  } else if (const double step = array.step > 0 ? array.step : axes.step; step > 0) {
    table.abscissa = Quantity::time;
    table.step = step;
    table.start = array.start;
  }
  table.name = array.group;
  for (Eigen::Index c = 0; c < columns.real.cols(); ++c) {
    Signal signal = make_signal(array.name, array.unit, columns.real.col(c));
    if (columns.inner > 0) {
      signal.name += fmt::format("({},{})", c / columns.inner + 1, c % columns.inner + 1);
    } else if (columns.real.cols() > 1) {
      signal.name += fmt::format("({})", c + 1);
    }
    if (array.imaginary.size() > 0)
      signal.imaginary = make_signal(array.name, array.unit, columns.imaginary.col(c)).value;
    add_signal(file, table, std::move(signal));
  }
}

}  // namespace

bool names_time(const NamedArray& array) { return is_one_of(word_of(array), kTimes); }

std::string word_of(const NamedArray& array) {
  const NameWithUnit split = split_unit(array.name);
  return small_letters(split.unit != nullptr && !split.name.empty() ? split.name : array.name);
}

void set_values(NamedArray& array, const Eigen::VectorXd& real, const Eigen::VectorXd& imaginary,
                const std::vector<std::size_t>& shape, bool columns_first) {
  std::array<Eigen::Index, 3> n = {1, 1, 1};
  for (std::size_t d = 0; d < std::min<std::size_t>(shape.size(), 3); ++d) n[d] = static_cast<Eigen::Index>(shape[d]);
  const bool cube = shape.size() > 2;
  // With the first index running fastest.
  const auto arranged = [&](const Eigen::VectorXd& v) {
    const Eigen::Index rows = cube ? v.size() : n[0];
    if (columns_first) return Eigen::MatrixXd(v.reshaped(rows, v.size() / rows));
    Eigen::MatrixXd m(rows, v.size() / rows);
    Eigen::Index at = 0;
    for (Eigen::Index i = 0; i < n[0]; ++i) {
      for (Eigen::Index j = 0; j < n[1]; ++j) {
        for (Eigen::Index k = 0; k < n[2]; ++k) m.data()[i + n[0] * (j + n[1] * k)] = v[at++];
      }
    }
    return m;
  };
  if (cube) array.sizes = n;
  array.value = arranged(real);
  if (imaginary.size() > 0) array.imaginary = arranged(imaginary);
}

void add_arrays(SignalFile& file, std::vector<NamedArray> arrays, const ResponseOptions* wanted) {
  std::vector<Eigen::Index> lines;
  for (const NamedArray& array : arrays)
    if (may_be_frequencies(array)) lines.push_back(array.value.size());
  join_parts(file, arrays, lines, wanted);
  std::map<std::string, Axes> groups;
  const std::set<Eigen::Index> complex = complex_lengths(arrays);
  std::vector<bool> is_axis;
  for (const NamedArray& array : arrays)
    is_axis.push_back(take_axis(array, complex, wanted, groups[array.group], file));
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const NamedArray& array = arrays[i];
    if (!array.integers.empty()) note_rounding(file, array.integers, array.value);
    if (is_axis[i]) continue;
    if (array.value.size() < 2) {
      if (array.value.size() == 1) file.contents.push_back(fmt::format("{} = {:g}", array.name, array.value(0, 0)));
      continue;
    }
    add_array(file, array, axes_of(groups, array.group), wanted);
  }
}

}  // namespace whirl::io
