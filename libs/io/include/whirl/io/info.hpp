#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl {

/// What a channel looks like. Values in SI.
struct ChannelInfo {
  std::string name;
  Quantity quantity = Quantity::dimensionless;
  double minimum = 0, maximum = 0, mean = 0;
  double rms = 0;                     ///< about zero
  std::vector<std::string> findings;  ///< suspicious things, one sentence each
};

/// What a record looks like, for `whirl info`.
struct RecordingInfo {
  std::string source;
  double rate = 0;      ///< Hz
  double duration = 0;  ///< s, number of samples / rate
  long samples = 0;
  std::vector<ChannelInfo> channels;
};

/// Range, mean and rms of every channel, and findings: constant; clipped (the extreme value is held for
/// several samples again and again); frozen (the same value for a long stretch in the middle of a changing
/// signal); dominated by its mean; coarse quantisation; single-sample spikes.
RecordingInfo describe(const Recording& record);
/// As a table for people.
std::string to_string(const RecordingInfo& info);

}  // namespace whirl
