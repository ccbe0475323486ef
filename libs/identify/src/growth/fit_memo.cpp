#include "growth/fit_memo.hpp"

#include <type_traits>

namespace whirl::identification::detail {
namespace {

/// The bytes of all that a fit begins with. The names of the members stand here so that a new one must be added.
class Key {
 public:
  template <typename... Values>
  Key& operator()(const Values&... values) {
    (add(values), ...);
    return *this;
  }
  std::string bytes;

 private:
  template <typename Plain>
  requires std::is_arithmetic_v<Plain> || std::is_pointer_v<Plain>
  void add(const Plain& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);  // of equal type: no padding
  }
  void add(const std::complex<double>& value) { (*this)(value.real(), value.imag()); }
  void add(const ForcedMode& mode) {
    const auto& [omega, zeta, participation] = mode;
    (*this)(omega, zeta, participation);
  }
  void add(const DecayingMode& mode) {
    const auto& [omega, zeta] = mode;
    (*this)(omega, zeta);
  }
  void add(const RotorTerm& term) {
    const auto& [entry, part, value, reference] = term;
    (*this)(entry, part, value, reference);
  }
  void add(const SensorAxes& axes) {
    const auto& [gain, angle, skew, high_pass, cubic, high_pass_square, gain_drift, drift_start] = axes;
    (*this)(gain, angle, skew, high_pass, cubic, high_pass_square, gain_drift, drift_start);
  }
  void add(const RotorModel& rotor) {
    const auto& [k1, k2, c, k1_conj, c_conj, eps, offset, gain, modes] = rotor;
    (*this)(k1, k2, c, k1_conj, c_conj, eps, offset, gain, modes);
  }
  void add(const OutputErrorOptions& options) {
    const auto& [rotor, conj_stiffness, conj_damping, record_k1, record_c, unbalance, offset, participation, decays,
                 poles, given_mode, delay, clock_drift, start_drift, terms, free_terms, sensor, sensors,
                 runout_harmonics, profile_degree, substeps, max_iterations, tolerance] = options;
    (*this)(rotor, conj_stiffness, conj_damping, record_k1, record_c, unbalance, offset, participation, decays, poles);
    (*this)(given_mode, delay, clock_drift, start_drift, terms, free_terms, sensor, sensors, runout_harmonics);
    (*this)(profile_degree, substeps, max_iterations, tolerance);
  }
  template <typename Value>
  void add(const std::vector<Value>& values) {
    (*this)(values.size());
    for (const Value& value : values) add(value);
  }
};

std::string key_of(const Growth& growth, const std::vector<std::complex<double>>& eps) {
  return Key{}(growth.start, growth.active, growth.delay, eps).bytes;
}

}  // namespace

FitMemo::FitMemo(const std::vector<RotorRecord>& records) {
  constexpr double kMost = 64e6, kSample = 120;  // bytes: in all, and what a fit holds of a sample
  double samples = 0;
  for (const RotorRecord& r : records) samples += static_cast<double>(r.size());
  most_ = static_cast<std::size_t>(kMost / (kSample * samples));
}

const OutputErrorFit* FitMemo::find(const Growth& growth, const std::vector<std::complex<double>>& eps) const {
  const auto at = fits_.find(key_of(growth, eps));
  return at != fits_.end() ? &at->second : nullptr;
}

void FitMemo::keep(const Growth& growth, const std::vector<std::complex<double>>& eps, const OutputErrorFit& fit) {
  if (fits_.size() < most_) fits_.emplace(key_of(growth, eps), fit);
}

}  // namespace whirl::identification::detail
