#pragma once
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::modal {

/// The part of a record that correlations may be taken from. Gaps of a few samples, and spikes where `spikes` says so
/// (what random forces do looks like them), are bridged;
/// a channel that is cut off at its limits for more than a thousandth of the time, or stands still or is missing for
/// more than half of it, is left out; of stretches in which a channel stands still, the longest run of samples between
/// them is kept for all channels. Everything done is a warning. Where nothing would be left, the record comes back as
/// it is and `summary` fails.
Recording usable_record(const Recording& recording, Summary& summary, bool spikes = true);

}  // namespace whirl::modal
