#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "whirl/response/continuation.hpp"
#include "whirl/response/sweep_peaks.hpp"

namespace whirl::response {

/// 95 % of the largest stable response at each speed, over systems drawn from a model's covariance.
struct CurveBand {
  Eigen::VectorXd omega;               ///< rad/s, ascending
  Eigen::VectorXd low, high;           ///< 2.5 % and 97.5 % of the largest response there
  double peak_low = 0, peak_high = 0;  ///< the same of the largest response in the range
  int draws = 0;
  int lost = 0;  ///< draws whose curve could not be found; they do not count
};

/// The next drawn system; empty: the draw has none (counted as lost).
using DrawSystem = std::function<std::optional<PeriodicSystem>()>;

/// Adds to a curve over speed (of the width `range`) the points where its amplitude is largest: a narrow resonance has
/// its top between two points.
void add_peaks(const PeriodicSystem& system, ResponseCurve& curve, double range, const Amplitude& amplitude);

/// `curves`: the main curve over speed at `force` of `system`, that the draws scatter about, then those beside it.
/// Every second point moves in the plane across its curve to the answer of the drawn system; so folds move with the
/// rest, and a point is taken for stable where that of the middle is (a curve without a stable point counts whole).
/// Where a draw is too far for that, its curves are followed anew. At
/// `speeds` equal steps of the curve's range the largest amplitude counts, cubics between the points.
/// Throws Error for fewer than 20 draws.
CurveBand curve_band(const PeriodicSystem& system, const std::vector<ResponseCurve>& curves, double force,
                     const CurveOptions& options, const Amplitude& amplitude, const DrawSystem& draw, int draws = 400,
                     int speeds = 200);

}  // namespace whirl::response
