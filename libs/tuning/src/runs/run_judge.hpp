#pragma once
#include <algorithm>
#include <cmath>
#include <complex>

#include "runs/standing_motion.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {

/// Follows one closed-loop run tick by tick and collects what the judge looks at. The same for scalar runs and lanes.
class RunJudge {
 public:
  /// `open`: of the plant without control. `segment`: of every tick (rig::segments); outlives the judge, nullptr: not
  /// followed. `rate` in Hz, `skip` in s.
  RunJudge(const rig::SegmentPeaks& open, const std::vector<int>* segment, double rate, double skip, long ticks,
           const VerdictLimits& limits = {}) noexcept
      : limits_(limits),
        segment_(segment),
        standing_(rate, skip, limits),
        diverged_(3 * open.all + 5e-3),
        rate_(rate),
        skip_(std::lround(skip * rate)),
        settle_(std::lround(0.5 * rate)),
        ticks_(ticks) {
    run_.open = open;
  }

  /// Displacement and speed at the next tick; false: the motion has diverged and the run is over.
  bool motion(std::complex<double> z, double omega) noexcept {
    rig::SegmentPeaks& closed = run_.closed;
    // Written so that NaN ends the run; far outside anything a useful controller does.
    const double square = std::norm(z);
    if (!(square <= diverged_ * diverged_)) {
      closed.all = std::max(closed.all, diverged_);
      return false;
    }
    if (tick_ >= skip_) {
      closed.all = std::max(closed.all, std::abs(z.real()));
      radial_ = std::max(radial_, square);
      if (segment_ != nullptr) {
        double& peak = closed.segment[static_cast<std::size_t>((*segment_)[static_cast<std::size_t>(tick_)])];
        peak = std::max(peak, std::abs(z.real()));
      }
    }
    turning_ = omega != 0;
    since_stop_ = turning_ ? 0 : since_stop_ + 1;
    if (since_stop_ > settle_) {
      still_x_ += z.real() * z.real();
      still_y_ += z.imag() * z.imag();
      ++still_;
    }
    return true;
  }
  /// What the loop read and did at that tick; `force`: of the x axis, N, as it acts.
  void cycle(const Measurement& m, double force, bool saturated, Fault trip) noexcept {
    cycle(m, turning_ && m.valid ? control::unit_phasor(m.beta) : 1, force, saturated, trip);
  }
  /// The same where e^{i beta} is known.
  void cycle(const Measurement& m, std::complex<double> turn, double force, bool saturated, Fault trip) noexcept {
    if (turning_ && m.valid) standing_.turned({m.x, m.y}, turn);
    saturated_ += saturated;
    if (turning_ && tick_ >= skip_) {
      ++judged_;
      saturated_turning_ += saturated;
    }
    variation_ += std::abs(force - last_force_);
    last_force_ = force;
    if (trip != Fault::none && run_.trip == Fault::none) {
      run_.trip = trip;
      trip_tick_ = tick_;
    }
    ++tick_;
  }

  long tick() const noexcept { return tick_; }
  const rig::SegmentPeaks& closed() const noexcept { return run_.closed; }  ///< |x|, m
  double radial_peak() const noexcept { return std::sqrt(radial_); }        ///< |z|, m
  /// Fraction of all ticks at the force limit.
  double saturated() const noexcept { return share(saturated_, tick_); }
  double total_variation() const noexcept { return variation_ * rate_ / static_cast<double>(std::max(tick_, 1L)); }

  /// `smooth_variation`: of the force that holds this rotor still, N/s; `nominal_excess`: what the design's nominal run
  /// has above it.
  JudgedRun collected(double smooth_variation, std::optional<double> nominal_excess) const {
    JudgedRun run = run_;
    const long end = run.trip != Fault::none ? trip_tick_ : tick_;
    run.survived = static_cast<double>(end) / static_cast<double>(ticks_);
    run.standstill_rms = still_ > 0 ? std::sqrt(std::max(still_x_, still_y_) / static_cast<double>(still_)) : 0;
    run.standing_rms = standing_.rms();
    run.standing_time = standing_.time();
    run.total_variation = total_variation();
    run.smooth_variation = smooth_variation;
    run.nominal_excess = nominal_excess;
    run.saturated_turning = share(saturated_turning_, judged_);
    return run;
  }
  const VerdictLimits& limits() const noexcept { return limits_; }

 private:
  static double share(long part, long whole) noexcept {
    return static_cast<double>(part) / static_cast<double>(std::max(whole, 1L));
  }

  VerdictLimits limits_;
  const std::vector<int>* segment_;
  StandingMotion standing_;
  JudgedRun run_;
  double diverged_, rate_;
  long skip_, settle_, ticks_;
  long tick_ = 0, since_stop_ = 0, still_ = 0, saturated_ = 0, saturated_turning_ = 0, judged_ = 0, trip_tick_ = 0;
  double radial_ = 0, still_x_ = 0, still_y_ = 0, variation_ = 0, last_force_ = 0;
  bool turning_ = true;
};

/// Motion of a rotor that nothing holds, as far as it is followed: one that whirls by itself grows out of every bound,
/// and a guard ends that. `most`: m.
inline std::complex<double> in_reach(std::complex<double> z, double most) noexcept {
  if (std::norm(z) <= most * most) return z;
  const double radius = std::abs(z);
  return std::isfinite(radius) ? z * (most / radius) : std::complex<double>(most);
}

/// N/s above the smooth force in the nominal run of a design; none for a design that does not say.
inline std::optional<double> nominal_excess(const ControllerDesign& design) {
  const auto found = design.margins.find("excess_variation");
  return found != design.margins.end() ? std::optional(found->second) : std::nullopt;
}

}  // namespace whirl::tuning
