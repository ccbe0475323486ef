// Frequency responses that stand in a file as complex arrays.
#include <fmt/format.h>

#include <charconv>

#include "formats/arrays/arrays.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

struct Meaning {
  FrfKind kind;
  double factor;  // to SI
};

// "m/s^2/N", "(m/s^2)/N", "g/lbf": motion per force; nothing for other labels.
std::optional<Meaning> meaning_of(const std::string& label) {
  const std::size_t slash = label.rfind('/');
  if (slash == std::string::npos) return {};
  const UnitSuffix* motion = unit_from_label(label.substr(0, slash));
  const UnitSuffix* force = unit_from_label(label.substr(slash + 1));
  if (motion == nullptr || force == nullptr || force->quantity != Quantity::force) return {};
  const std::optional<FrfKind> kind = kind_of_motion(motion->quantity);
  return kind ? std::optional(Meaning{*kind, motion->to_si(1) / force->to_si(1)}) : std::nullopt;
}

// H(2,1): second response to the first reference; "3:+Z/1:+X" names both. Numbers are no points: out2 is not in2.
std::pair<std::string, std::string> points_of(const std::string& name) {
  if (const std::size_t slash = name.find('/'); slash != std::string::npos)
    return {name.substr(0, slash), name.substr(slash + 1)};
  const std::size_t open = name.rfind('('), comma = name.rfind(',');
  if (open == std::string::npos || !name.ends_with(')')) return {name, "in1"};
  const bool pair = comma != std::string::npos && comma > open;
  const std::size_t end = pair ? comma : name.size() - 1;
  const std::string prefix = name.substr(0, open) + ".";
  return {prefix + "out" + name.substr(open + 1, end - open - 1),
          prefix + "in" + (pair ? name.substr(comma + 1, name.size() - comma - 2) : std::string("1"))};
}

}  // namespace

namespace {

// Arrays that look like frequency responses, in a file with neither these nor a record: what they lack.
void refuse_halves(const SignalFile& file) {
  std::string real, without_axis;
  for (const SignalTable& table : file.tables) {
    if (table.abscissa == Quantity::time) return;
    for (const Signal& signal : table.signals) {
      std::string& names = table.abscissa == Quantity::frequency && signal.imaginary.size() == 0 ? real : without_axis;
      if (&names == &without_axis && signal.imaginary.size() == 0) continue;
      if (names.size() < 80) names += fmt::format("{}'{}'", names.empty() ? "" : ", ", signal.name);
    }
  }
  if (!without_axis.empty()) {
    throw Error::in_file(file.source, 0,
                         fmt::format("{}: complex, but no frequencies of as many lines: a vector called freq (or f, or "
                                     "w in rad/s) is needed",
                                     without_axis));
  }
  if (!real.empty()) {
    throw Error::in_file(file.source, 0,
                         fmt::format("{}: real over a frequency: frequency responses are complex, or two arrays of one "
                                     "size called H_re and H_im (or H_mag and H_phase_deg)",
                                     real));
  }
}

}  // namespace

std::optional<FrequencyResponse> responses_of(const SignalFile& file, const ResponseOptions& options) {
  FrequencyResponse frf;
  bool stated = false;
  for (const SignalTable& table : file.tables) {
    for (const Signal& signal : table.signals) {
      if (signal.imaginary.size() == 0 || table.abscissa != Quantity::frequency) continue;
      const auto fail = [&](const std::string& what) {
        return Error::in_file(file.source, 0, fmt::format("frequency response '{}' {}", signal.name, what));
      };
      if (!(table.step > 0)) throw fail("has frequencies that are not uniform");
      std::optional<Meaning> meaning = meaning_of(signal.unit);
      if (!meaning && options.kind) meaning = Meaning{*options.kind, 1};
      if (!meaning) throw fail("does not say what was measured: state --kind");
      const Eigen::Index n = signal.value.size();
      if (frf.channels.empty()) {
        frf.kind = meaning->kind;
        frf.frequency.resize(n);
        for (Eigen::Index i = 0; i < n; ++i) frf.frequency[i] = table.start + table.step * static_cast<double>(i);
      } else if (n != frf.frequency.size() || meaning->kind != frf.kind ||
                 std::abs(table.start - frf.frequency[0]) > 1e-6 * table.step) {
        throw fail("must have the kind and the frequencies of the first");
      }
      stated = stated || !signal.unit.empty();
      auto [response, reference] = points_of(signal.name);
      Eigen::VectorXcd value(n);
      value.real() = meaning->factor * signal.value;
      value.imag() = meaning->factor * signal.imaginary;
      frf.channels.push_back({std::move(response), std::move(reference), std::move(value), {}, {}});
    }
  }
  if (frf.channels.empty()) {
    refuse_halves(file);
    return {};
  }
  frf.averages = 0;
  for (const std::string& finding : file.findings) frf.summary.warn(finding);
  frf.provenance.inputs = {file.source};
  return frf;
}

}  // namespace whirl::io
