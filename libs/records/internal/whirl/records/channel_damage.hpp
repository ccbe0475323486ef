#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/records/check.hpp"

namespace whirl::records {

/// What one channel of a record lost, for methods that take a channel on its own (a free decay, a swept sine).
struct ChannelDamage {
  Eigen::ArrayX<bool> usable;     ///< samples that count; empty: all
  std::vector<Finding> findings;  ///< clipping, frozen stretches, dropouts, spikes, splices

  /// "SOURCE: text" of what concerns samples between two times from the record's begin, s. The onset of a decay is no
  /// spike in it.
  std::vector<std::string> warnings(const Recording& record, double from, double to) const;
};

/// Searches the channel for all of it, whatever it measures: `check` looks at a force for gaps only. Throws Error for a
/// name that is no channel, and as `check`.
ChannelDamage channel_damage(const Recording& record, const std::string& channel);

}  // namespace whirl::records
