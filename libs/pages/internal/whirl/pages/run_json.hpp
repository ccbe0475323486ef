#pragma once
#include <array>
#include <string>

#include "whirl/io/json.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::pages {

/// Names of the four segments of paper Fig. 24, in order.
extern const std::array<const char*, 4> kSegmentNames;

/// Paper Table 4: segments 1 to 4 and row 5, m; the paper does not name the kind of amplitude.
inline constexpr std::array<double, 5> kPaperOpen{0.41e-3, 2.25e-3, 6.45e-3, 2.59e-3, 6.45e-3};
inline constexpr std::array<double, 5> kPaperClosed{0.16e-3, 0.20e-3, 0.26e-3, 0.47e-3, 0.47e-3};

/// whirl.run/1: segments[] and whole with open_peak, closed_peak (m, zero-to-peak), suppression (0 to 1);
/// standstill_rms (m), force_rms, force_peak, force_y_rms, force_y_peak (N), total_variation, excess_variation (N/s),
/// saturated, held, stable, trip.
io::Json to_json(const tuning::ClosedLoopMetrics& metrics);

/// "x 5.50 N rms, 27.4 N peak; y 5.52 N rms, 27.9 N peak".
std::string force_text(const tuning::ClosedLoopMetrics& metrics);

/// The same as Table 4 of the paper, with its numbers beside when `with_paper` (5 g run).
report::Table segment_table(const tuning::ClosedLoopMetrics& metrics, const std::string& caption, bool with_paper);

}  // namespace whirl::pages
