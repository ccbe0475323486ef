#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::identification::detail {

/// Missing readings of an angle channel from angle and speed on both sides of the gap (one or two: a straight line);
/// whole turns go by the mean of the speeds. A warning says so. Throws Error where a longer gap ends the record.
void bridge_angle(const Channel& read, Recording& recording, Summary& summary);

/// The record with one or two missing samples in a row read off the polynomial through two samples on either side,
/// whose noise is nearly that of a sample (four of a channel without noise); longer gaps stay, and channels that lack
/// more than 5 %. Each channel with such samples is a warning.
Recording with_single_gaps_bridged(const Recording& record, Summary& summary);

/// The record from the first to the last sample that has every input and one state at least; as it is when none has.
Recording without_empty_ends(const Recording& record, const std::vector<std::string>& states,
                             const std::vector<std::string>& inputs);

/// The longest stretch without a missing sample; the record itself where nothing is missing.
Recording longest_whole_stretch(const Recording& record);

}  // namespace whirl::identification::detail
