#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/quantity.hpp"

namespace whirl {

/// One sampled signal in SI units.
struct Channel {
  std::string name;  ///< e.g. "x", "y", "beta", "ux"
  Quantity quantity = Quantity::dimensionless;
  Eigen::VectorXd samples;
};

/// Signals sampled together at one constant rate. Sample i is at t0 + i dt.
struct Recording {
  double t0 = 0;       ///< s
  double dt = 0;       ///< s, > 0
  std::string source;  ///< file or generator, for messages and provenance
  std::vector<Channel> channels;

  Eigen::Index size() const { return channels.empty() ? 0 : channels.front().samples.size(); }
  double duration() const { return dt * static_cast<double>(size()); }
  double rate() const { return 1.0 / dt; }
  bool has(std::string_view name) const { return find(name) != nullptr; }
  const Channel* find(std::string_view name) const;
  /// The named channel; throws Error listing the names present when it is absent.
  const Channel& at(std::string_view name) const;
  const Eigen::VectorXd& operator[](std::string_view name) const { return at(name).samples; }
  void add(std::string name, Quantity quantity, Eigen::VectorXd samples);
  /// Sample times, s.
  Eigen::VectorXd times() const;
  /// Throws Error unless dt > 0, all channels are equally long and every sample is finite.
  void check() const;
};

}  // namespace whirl
