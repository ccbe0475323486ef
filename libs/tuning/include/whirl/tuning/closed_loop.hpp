#pragma once
#include <complex>
#include <cstdint>
#include <memory>
#include <vector>

#include "whirl/control/reidentifier.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/rig/segments.hpp"
#include "whirl/rt/safety.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::rig {
class RigTables;
}

namespace whirl::tuning {

/// How a controller did on one run of the virtual rig. Amplitudes are of the TRUE disk centre, x axis,
/// zero-to-peak, m, the first `skip` seconds left out; forces are those after converter and limit, x axis unless
/// stated.
struct ClosedLoopMetrics {
  rig::SegmentPeaks open;  ///< the same plant without control
  rig::SegmentPeaks closed;
  rig::SegmentPeaks suppression;  ///< 1 - closed / open
  double radial_peak = 0;         ///< largest |z|, m
  double standstill_rms =
      0;  ///< rms of the worse axis while the shaft stands still at the end, m; 0 without standstill
  double force_rms = 0, force_peak = 0;      ///< N
  double force_y_rms = 0, force_y_peak = 0;  ///< N, y axis
  double total_variation = 0;                ///< of the force, N/s: sum |u[k] - u[k-1]| / duration
  double excess_variation = 0;  ///< N/s above the smooth force that holds the disk still: chattering and detours
  double saturated = 0;         ///< fraction of ticks at the force limit
  long held = 0;                ///< samples lost and bridged
  Fault trip = Fault::none;
  double survived = 1;                         ///< fraction of the run before divergence or trip
  double smooth_variation = 0;                 ///< of the force that holds this rotor still, N/s
  double standing_rms = 0;                     ///< motion beside the synchronous one while turning, m rms; 0: none
  double saturated_turning = 0;                ///< fraction of the ticks of a turning shaft at the force limit
  std::uint32_t supervision = 0;               ///< every bit of the status word that stood (control/supervisor.hpp)
  double supervised = -1;                      ///< first time at which a bit stood, s; negative: never
  double watched_level = 0;                    ///< largest level that supervision saw after its first 0.3 s, m rms
  control::Reidentification reidentification;  ///< what it determined last
  Verdict verdict;                             ///< of the one judge, see verdict.hpp
  bool stable = true;                          ///< verdict.passed()
};

struct ClosedLoopOptions {
  rig::RigRun run;          ///< seed of the sensor noise, scripted faults
  rt::SafetyLimits safety;  ///< of the loop; the force limit of the design acts in any case
  rig::SegmentBounds bounds;
  double skip = 0.5;      ///< start transient left out of the peaks, s
  VerdictLimits verdict;  ///< what makes a run a failure
};

/// One plant for many runs: angle tables and open-loop peaks are computed once and shared. Const members may
/// be called from several threads.
class ClosedLoopPlant {
 public:
  /// Throws Error when the rig parameters are out of range.
  explicit ClosedLoopPlant(const rig::RigParameters& rig, const ClosedLoopOptions& options = {});

  /// Runs the design. With `log`, every tick is recorded: x_true, y_true, x, y (measured), x_est, y_est,
  /// vx_est, vy_est, ux_requested, uy_requested, ux, uy (acting), s_x, s_y, beta, omega, and x_open, y_open
  /// of the plant without control. `seed` replaces the seed of the options unless 0; `faults` come to those of the
  /// options. Throws Error for a bad design.
  ClosedLoopMetrics run(const ControllerDesign& design, Recording* log = nullptr, std::uint64_t seed = 0,
                        const std::vector<rig::ScriptedFault>& faults = {}) const;

  const rig::SegmentPeaks& open() const { return open_; }
  const rig::RigParameters& rig() const { return rig_; }

 private:
  rig::RigParameters rig_;
  ClosedLoopOptions options_;
  std::shared_ptr<const rig::RigTables> tables_;
  std::vector<int> segment_;
  std::vector<std::complex<double>> open_motion_;
  double smooth_variation_ = 0;  ///< of the force that cancels the unbalance exactly, N/s
  rig::SegmentPeaks open_;
};

/// One run with its log.
struct ClosedLoopRun {
  Recording log;
  ClosedLoopMetrics metrics;
};
ClosedLoopRun run_closed_loop(const ControllerDesign& design, const rig::RigParameters& rig,
                              const ClosedLoopOptions& options = {});

}  // namespace whirl::tuning
