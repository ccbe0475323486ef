#include "whirl/identify/parts/readings.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>

namespace whirl::identification {
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

double value_or(const IdentifiedModel& model, const std::string& name, double otherwise) {
  const Estimate* e = model.parameter(name);
  return e != nullptr ? e->value : otherwise;
}

/// The numbers of `rotor` that stand among the parameters.
void take_rotor(const IdentifiedModel& from, RotorModel& r) {
  r.k1 = value_or(from, "k1", r.k1);
  r.k2 = value_or(from, "k2", r.k2);
  r.c = value_or(from, "c", r.c);
  r.eps = std::polar(value_or(from, "e", std::abs(r.eps)), value_or(from, "e_phase", std::arg(r.eps)));
  r.k1_conj = {value_or(from, "k1_conj_re", r.k1_conj.real()), value_or(from, "k1_conj_im", r.k1_conj.imag())};
  r.c_conj = {value_or(from, "c_conj_re", r.c_conj.real()), value_or(from, "c_conj_im", r.c_conj.imag())};
  for (std::size_t k = 0; k < r.modes.size(); ++k) {
    const std::string mode = fmt::format("mode{}", k + 1);
    r.modes[k].participation = {value_or(from, mode + "_re", r.modes[k].participation.real()),
                                value_or(from, mode + "_im", r.modes[k].participation.imag())};
  }
}

/// By how much the deviation of each parameter of `model` changes.
double ratio(const Estimate& before, const Estimate& now) {
  return std::isfinite(now.sd) && before.sd > 0 ? now.sd / before.sd : 1;
}

}  // namespace

void scale_unbalance(RotorModel& rotor, std::complex<double> by) {
  rotor.eps *= by;
  for (ForcedMode& mode : rotor.modes) mode.participation *= by;
}

IdentifiedModel as_read(const IdentifiedModel& model, const Alternative& alternative) {
  IdentifiedModel out = model;
  out.ambiguities.clear();
  const auto n = static_cast<Eigen::Index>(model.parameters.size());
  std::vector<double> scale(model.parameters.size(), 1);
  std::vector<Eigen::Index> from;  // row of the model's covariance that a parameter takes; -1: its own
  for (Eigen::Index i = 0; i < n; ++i) from.push_back(i);
  Eigen::Index replaced = -1;
  for (const auto& [name, e] : alternative.parameters) {
    const auto at = std::ranges::find(out.parameters, name, &std::pair<std::string, Estimate>::first);
    if (at == out.parameters.end()) continue;
    const auto place = at - out.parameters.begin();
    scale[static_cast<std::size_t>(place)] = ratio(at->second, e);
    if (e.value == 0 && at->second.value != 0) replaced = place;
    at->second = e;
  }
  for (const auto& [name, e] : alternative.parameters) {
    if (out.parameter(name) != nullptr) continue;
    out.parameters.emplace_back(name, e);
    from.push_back(replaced);
    scale.push_back(replaced >= 0 ? ratio(model.parameters[static_cast<std::size_t>(replaced)].second, e) : 1);
    replaced = -1;
  }
  if (n > 0 && static_cast<Eigen::Index>(model.parameter_covariance.size()) == n * n) {
    const Eigen::Map<const Rows> all(model.parameter_covariance.data(), n, n);
    const auto size = static_cast<Eigen::Index>(from.size());
    Rows joint = Rows::Zero(size, size);
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j < size; ++j) {
        const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
        if (from[a] >= 0 && from[b] >= 0) joint(i, j) = scale[a] * scale[b] * all(from[a], from[b]);
      }
      const double sd = out.parameters[static_cast<std::size_t>(i)].second.sd;
      if (from[static_cast<std::size_t>(i)] < 0 && std::isfinite(sd)) joint(i, i) = sd * sd;
    }
    out.parameter_covariance.assign(joint.data(), joint.data() + joint.size());
  }
  if (out.rotor) take_rotor(out, *out.rotor);
  if (alternative.rotor_covariance.size() == 25) {
    out.rotor_covariance = alternative.rotor_covariance;
  } else if (model.rotor_covariance.size() == 25) {
    constexpr const char* names[] = {"k1", "k2", "c", "e", "e"};
    for (std::size_t i = 0; i < 5; ++i) {
      const Estimate *before = model.parameter(names[i]), *now = out.parameter(names[i]);
      const double by = before != nullptr && now != nullptr ? ratio(*before, *now) : 1;
      for (std::size_t j = 0; j < 5; ++j) out.rotor_covariance[5 * i + j] *= by, out.rotor_covariance[5 * j + i] *= by;
    }
  }
  return out;
}

std::vector<ModelReading> other_readings(const IdentifiedModel& model, bool covered) {
  std::vector<ModelReading> out;
  for (const Ambiguity& a : model.ambiguities) {
    if (a.covered && !covered) continue;
    for (const Alternative& one : a.alternatives) out.push_back({one.reading, one.odds, as_read(model, one)});
  }
  return out;
}

}  // namespace whirl::identification
