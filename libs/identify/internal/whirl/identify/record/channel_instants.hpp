#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {

/// A channel whose samples are not taken at the record's instants.
struct LateChannel {
  std::string channel;
  double seconds = 0;  ///< by which it is read after them; negative: before
};
/// "v=0.005"; throws Error.
LateChannel late_channel(const std::string& text);

/// The record with a channel brought to the instants of the others by band-limited interpolation, without the samples
/// at the end for which it was not read. Beside a gap more is missing. Throws Error for a channel that it lacks and a
/// delay as long as the record.
Recording at_common_instants(Recording record, const LateChannel& late);

/// State channels that are read at other instants than the state whose rate they are: where an equation x' = c v holds
/// to 5 % of the variance with v alone, the delay of v by which it holds best, if that takes away a twentieth of what
/// is left at least and is more than 0.03 samples. By the weak form, to first order. Such a delay and small other terms
/// in x' can be the same motion: what is found is to be tried, not believed. First order systems only.
std::vector<LateChannel> late_channels(const std::vector<Recording>& records, const SindyOptions& options);

}  // namespace whirl::identification
