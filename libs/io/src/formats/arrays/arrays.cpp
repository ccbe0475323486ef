#include "formats/arrays/arrays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>

namespace whirl::io {
namespace {

struct Axes {
  SignalTable time, frequency;
  Eigen::Index times = -1, frequencies = -1;  ///< their lengths
  double step = 0;
};

// Name without unit, lower case, for the words that mean an axis.
std::string word_of(const NamedArray& array) {
  const NameWithUnit split = split_unit(array.name);
  std::string word = split.unit != nullptr && !split.name.empty() ? split.name : array.name;
  for (char& c : word) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return word;
}

bool is_vector(const NamedArray& array) {
  return array.imaginary.size() == 0 && array.value.size() > 1 && (array.value.rows() == 1 || array.value.cols() == 1);
}

// Lines of the complex arrays: a vector of this length that is called f, w or omega is their axis and no force or
// speed.
std::set<Eigen::Index> complex_lengths(const std::vector<NamedArray>& arrays) {
  std::set<Eigen::Index> lengths;
  for (const NamedArray& array : arrays) {
    if (array.imaginary.size() == 0) continue;
    lengths.insert(array.value.rows());
    if (array.inner == 0) lengths.insert(array.value.cols());
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

// An axis by a letter, beside complex arrays of its length: f in Hz, w or omega in rad/s.
bool take_short_axis(const NamedArray& array, const std::string& word, Axes& axes, SignalFile& file) {
  const bool angular = word == "w" || word == "omega";
  if (!(angular || word == "f") || array.imaginary.size() > 0 || axes.frequencies > 0) return false;
  const Eigen::Map<const Eigen::VectorXd> values(array.value.data(), array.value.size());
  if (!ascends_evenly(values)) return false;
  const Signal s = make_signal(array.name, array.unit, values);
  if (s.quantity && *s.quantity != (angular ? Quantity::angular_velocity : Quantity::frequency)) return false;
  if (!s.quantity)
    file.findings.push_back(fmt::format("'{}' has no unit: taken as {}", array.name, angular ? "rad/s" : "Hz"));
  set_abscissa(axes.frequency, Quantity::frequency,
               angular ? Eigen::VectorXd(s.value / (2 * std::numbers::pi)) : s.value);
  axes.frequencies = values.size();
  return true;
}

// True when the array is an axis of its group, which is then filled.
bool take_axis(const NamedArray& array, const std::set<Eigen::Index>& complex, Axes& axes, SignalFile& file) {
  const std::string word = word_of(array);
  const double scalar = array.value.size() == 1 ? array.value(0, 0) : 0;
  if (scalar > 0 && (word == "dt" || word == "fs" || word == "rate" || word == "sample_rate" ||
                     word == "sampling_rate" || word == "samplerate")) {
    const Signal s = make_signal(array.name, array.unit, Eigen::VectorXd::Constant(1, scalar));
    axes.step = word == "dt" ? s.value[0] : 1 / s.value[0];
    return true;
  }
  static const std::set<std::string> kTimes = {"t", "time", "times"},
                                     kFrequencies = {"freq", "freqs", "frequency", "frequencies"};
  const bool time = kTimes.contains(word), frequency = kFrequencies.contains(word);
  if (is_vector(array) && complex.contains(array.value.size()) && take_short_axis(array, word, axes, file)) return true;
  if (!is_vector(array) || !(time || frequency)) return false;
  const Eigen::Map<const Eigen::VectorXd> values(array.value.data(), array.value.size());
  const Signal s = make_signal(array.name, array.unit, values);
  const Quantity quantity = time ? Quantity::time : Quantity::frequency;
  if (s.quantity && *s.quantity != quantity) return false;
  if (!s.quantity) file.findings.push_back(fmt::format("'{}' has no unit: taken as {}", array.name, si_unit(quantity)));
  set_abscissa(time ? axes.time : axes.frequency, quantity, s.value);
  (time ? axes.times : axes.frequencies) = values.size();
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

}  // namespace

void set_values(NamedArray& array, const Eigen::VectorXd& real, const Eigen::VectorXd& imaginary,
                const std::vector<std::size_t>& shape, bool columns_first) {
  std::vector<Eigen::Index> n;
  for (const std::size_t size : shape) n.push_back(static_cast<Eigen::Index>(size));
  while (n.size() < 2) n.push_back(1);
  if (n.size() == 2) n.push_back(1);
  const auto at = [&](Eigen::Index i, Eigen::Index j, Eigen::Index k) {
    return columns_first ? i + n[0] * (j + n[1] * k) : (i * n[1] + j) * n[2] + k;
  };
  const bool three = shape.size() > 2;
  const std::size_t lines = three ? static_cast<std::size_t>(std::max_element(n.begin(), n.end()) - n.begin()) : 0;
  const std::size_t outer = lines == 0 ? 1 : 0, inner = lines == 2 ? 1 : 2;
  array.inner = three ? n[inner] : 0;
  const auto arranged = [&](const Eigen::VectorXd& v) {
    Eigen::MatrixXd m(n[lines], n[outer] * n[inner]);
    std::array<Eigen::Index, 3> index{};
    for (index[0] = 0; index[0] < n[0]; ++index[0]) {
      for (index[1] = 0; index[1] < n[1]; ++index[1]) {
        for (index[2] = 0; index[2] < n[2]; ++index[2])
          m(index[lines], index[outer] * n[inner] + index[inner]) = v[at(index[0], index[1], index[2])];
      }
    }
    return m;
  };
  array.value = arranged(real);
  if (imaginary.size() > 0) array.imaginary = arranged(imaginary);
}

void add_arrays(SignalFile& file, const std::vector<NamedArray>& arrays) {
  std::map<std::string, Axes> groups;
  const std::set<Eigen::Index> complex = complex_lengths(arrays);
  std::vector<bool> is_axis;
  for (const NamedArray& array : arrays) is_axis.push_back(take_axis(array, complex, groups[array.group], file));
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const NamedArray& array = arrays[i];
    if (is_axis[i]) continue;
    if (array.value.size() < 2) {
      if (array.value.size() == 1) file.contents.push_back(fmt::format("{} = {:g}", array.name, array.value(0, 0)));
      continue;
    }
    const Axes& axes = axes_of(groups, array.group);
    const bool along_rows = array.inner > 0 || array.value.rows() >= array.value.cols();
    const Eigen::Index length = along_rows ? array.value.rows() : array.value.cols();
    const Eigen::Index channels = along_rows ? array.value.cols() : array.value.rows();
    SignalTable table;
    if (length == axes.times) {
      table = axes.time;
    } else if (length == axes.frequencies) {
      table = axes.frequency;
    } else if (const double step = array.step > 0 ? array.step : axes.step; step > 0) {
      table.abscissa = Quantity::time;
      table.step = step;
      table.start = array.start;
    }
    table.name = array.group;
    for (Eigen::Index c = 0; c < channels; ++c) {
      const auto part = [&](const Eigen::MatrixXd& m) {
        return along_rows ? Eigen::VectorXd(m.col(c)) : Eigen::VectorXd(m.row(c).transpose());
      };
      Signal signal = make_signal(array.name, array.unit, part(array.value));
      if (array.inner > 0) {
        signal.name += fmt::format("({},{})", c / array.inner + 1, c % array.inner + 1);
      } else if (channels > 1) {
        signal.name += fmt::format("({})", c + 1);
      }
      if (array.imaginary.size() > 0)
        signal.imaginary = make_signal(array.name, array.unit, part(array.imaginary)).value;
      add_signal(file, table, std::move(signal));
    }
  }
}

}  // namespace whirl::io
