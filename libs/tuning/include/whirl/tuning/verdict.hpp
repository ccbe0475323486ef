#pragma once
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/rig/segments.hpp"

namespace whirl::tuning {

/// What makes a closed-loop run a failure: one judge for `run`, `design`, `compare` and `robustness`.
struct VerdictLimits {
  double standing_rms =
      30e-6;  ///< m rms: limit cycle or offset at standstill; motion that does not turn with the rotor
  double standing_share = 0.25;  ///< the latter may reach this share of the synchronous amplitude where that is more
  double standing_time = 1;      ///< s it must last, without decaying, to stand
  double segment_ratio = 1;      ///< closed / open peak of any segment
  double segment_floor = 5e-6;   ///< m by which a segment may exceed the open loop: sensors end there
  double variation = 1.5;        ///< total variation of the force / the nominal one
  double saturated = 0.01;       ///< fraction of the ticks of a turning shaft at the force limit
  double delay_samples = 0.5;    ///< least further delay, in samples
  /// Largest peak sensitivity of a loop: the end of zone B of ISO 14839-3 (12 dB), in which a machine may run without
  /// limit of time. The margins below are those that every loop within it has.
  double peak_sensitivity = 4;

  double modulus() const { return 1 / peak_sensitivity; }
  double gain_up() const { return peak_sensitivity / (peak_sensitivity - 1); }
  double gain_down() const { return peak_sensitivity / (peak_sensitivity + 1); }
  double phase() const { return 2 * std::asin(0.5 / peak_sensitivity); }  ///< rad
};

/// Why the margins that stand in a design do not do (missed_margin in loop_margins.hpp); empty: they do, or it states
/// none.
std::string margin_shortfall(const ControllerDesign& design, const VerdictLimits& limits = {});

/// What the judge looks at, of one run.
struct JudgedRun {
  std::string margins;  ///< margin_shortfall of the design that runs; empty: none
  Fault trip = Fault::none;
  double survived = 1;        ///< fraction of the run before divergence or trip
  double standstill_rms = 0;  ///< m, worse axis
  double standing_rms = 0;    ///< m: largest motion beside the synchronous one while turning; 0: none
  double standing_time = 0;   ///< s into the run
  rig::SegmentPeaks open, closed;
  double total_variation = 0;            ///< N/s
  double smooth_variation = 0;           ///< N/s of the force that holds this rotor still
  std::optional<double> nominal_excess;  ///< N/s above it in the design's nominal run; unknown: not judged
  double saturated_turning = 0;
};

/// Reasons in the order of their weight; empty: the run passes.
struct Verdict {
  std::vector<std::string> reasons;
  bool stable = true;  ///< no divergence, trip, standing motion: the first reasons
  bool passed() const { return reasons.empty(); }
  std::string text() const;  ///< one line
};
Verdict judge(const JudgedRun& run, const VerdictLimits& limits = {});

}  // namespace whirl::tuning
