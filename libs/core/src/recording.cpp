#include "whirl/core/recording.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"

namespace whirl {

const Channel* Recording::find(std::string_view name) const {
  for (const Channel& c : channels) {
    if (c.name == name) return &c;
  }
  const std::string small = channel_role(name);
  for (const Channel& c : channels) {
    if (channel_role(c.name) == small) return &c;
  }
  return nullptr;
}

const Channel& Recording::at(std::string_view name) const {
  if (const Channel* c = find(name)) return *c;
  std::string present;
  for (const Channel& c : channels) present += (present.empty() ? "" : ", ") + c.name;
  throw Error(fmt::format("{}: no channel '{}'; present: {}", source.empty() ? "recording" : source, name,
                          present.empty() ? "none" : present));
}

void Recording::add(std::string name, Quantity quantity, Eigen::VectorXd samples) {
  channels.push_back({std::move(name), quantity, std::move(samples)});
}

Eigen::VectorXd Recording::times() const {
  const Eigen::Index n = size();
  Eigen::VectorXd t(n);
  for (Eigen::Index i = 0; i < n; ++i) t[i] = t0 + dt * static_cast<double>(i);
  return t;
}

void Recording::check() const {
  const std::string where = source.empty() ? "recording" : source;
  if (!(dt > 0) || !std::isfinite(dt)) throw Error(fmt::format("{}: sample time {:g} s: must be > 0", where, dt));
  for (const Channel& c : channels) {
    if (c.samples.size() != size()) {
      throw Error(fmt::format("{}: channel '{}' has {} samples, '{}' has {}: must be equal", where, c.name,
                              c.samples.size(), channels.front().name, size()));
    }
    for (Eigen::Index i = 0; i < c.samples.size(); ++i) {
      if (!std::isfinite(c.samples[i])) {
        throw Error(
            fmt::format("{}: channel '{}', sample {}: {} is not a finite number", where, c.name, i, c.samples[i]));
      }
    }
  }
}

}  // namespace whirl
