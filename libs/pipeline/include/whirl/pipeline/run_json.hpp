#pragma once
#include <array>
#include <string>

#include "whirl/io/json.hpp"
#include "whirl/pipeline/closed_loop.hpp"
#include "whirl/report/table.hpp"

namespace whirl {

/// Names of the four segments of paper Fig. 24, in order.
extern const std::array<const char*, 4> kSegmentNames;

/// whirl.run/1: segments[] and whole with open_peak, closed_peak (m, zero-to-peak), suppression (0 to 1); standstill_rms (m),
/// force_rms, force_peak (N), total_variation (N/s), saturated, held, stable, trip.
Json to_json(const ClosedLoopMetrics& metrics);

/// The same as Table 4 of the paper, with its numbers beside when `with_paper` (5 g run).
report::Table segment_table(const ClosedLoopMetrics& metrics, const std::string& caption, bool with_paper);

}  // namespace whirl
