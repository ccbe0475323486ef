#pragma once
#include <functional>
#include <string>
#include <vector>

#include "whirl/io/record_stream.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// What a channel looks like. Values in SI, of the finite samples.
struct ChannelInfo {
  std::string name;
  Quantity quantity = Quantity::dimensionless;
  std::string unit;  ///< SI symbol, or what the file writes where that is no known unit
  double minimum = 0, maximum = 0, mean = 0;
  double rms = 0;                     ///< about zero
  std::vector<std::string> findings;  ///< suspicious things, one sentence each
  std::vector<std::string> damage;    ///< clipped, frozen, spikes: `records::check` tells more of these
};

/// What a file of any format holds, for `whirl info`. A table is a set of channels over one abscissa.
struct TableInfo {
  std::string name;
  std::string abscissa;        ///< "time", "frequency" or "rows"
  double start = 0, step = 0;  ///< SI; step 0 when not uniform or not stated
  long rows = 0;
  std::vector<ChannelInfo> channels;  ///< of complex values: of their magnitude
};
struct FileInfo {
  std::string source, format;
  std::vector<TableInfo> tables;
  std::vector<std::string> contents, findings;
};
/// Range, mean and rms of every channel, and findings: constant; clipped (the extreme value is held for
/// several samples again and again); frozen (the same value for a long stretch in the middle of a changing
/// signal); dominated by its mean; coarse quantisation; single-sample spikes.
FileInfo describe(const SignalFile& file);
/// The same of a file in parts: ranges, means, missing and constant values, no damage. `progress` is told the share
/// that is done.
FileInfo describe(SignalStream& stream, const std::function<void(double)>& progress);

/// As a table for people.
std::string to_string(const FileInfo& info);

}  // namespace whirl::io
