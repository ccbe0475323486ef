#pragma once
#include <algorithm>
#include <cmath>
#include <complex>

#include "whirl/core/control_types.hpp"

namespace whirl::tuning {

/// Follows the true motion of one closed-loop run: peaks, the standstill at its end, divergence. The same for scalar
/// runs and lanes.
class RunJudge {
 public:
  static constexpr double kLimitCycle = 30e-6;  ///< m rms at standstill

  /// `open_peak`: of the plant without control, m. `rate` in Hz, `skip` in s.
  RunJudge(double open_peak, double rate, double skip, long ticks) noexcept
      : diverged_(3 * open_peak + 5e-3),
        skip_(std::lround(skip * rate)),
        settle_(std::lround(0.5 * rate)),
        ticks_(ticks) {}

  /// Displacement and speed at the next tick; false: the motion has diverged and the run is over.
  bool motion(std::complex<double> z, double omega) noexcept {
    // Written so that NaN ends the run; far outside anything a useful controller does.
    if (!(std::abs(z) <= diverged_)) {
      peak_ = std::max(peak_, diverged_);
      return false;
    }
    if (tick_ >= skip_) {
      peak_ = std::max(peak_, std::abs(z.real()));
      radial_ = std::max(radial_, std::abs(z));
    }
    since_stop_ = omega == 0 ? since_stop_ + 1 : 0;
    if (since_stop_ > settle_) {
      still_x_ += z.real() * z.real();
      still_y_ += z.imag() * z.imag();
      ++still_;
    }
    return true;
  }
  /// What the loop did at that tick.
  void cycle(bool saturated, Fault trip) noexcept {
    saturated_ += saturated;
    if (trip != Fault::none && trip_ == Fault::none) {
      trip_ = trip;
      trip_tick_ = tick_;
    }
    ++tick_;
  }

  long tick() const noexcept { return tick_; }
  long skip() const noexcept { return skip_; }
  double peak() const noexcept { return peak_; }           ///< |x|, m
  double radial_peak() const noexcept { return radial_; }  ///< |z|, m
  Fault trip() const noexcept { return trip_; }
  double survived() const noexcept {
    return static_cast<double>(trip_ != Fault::none ? trip_tick_ : tick_) / static_cast<double>(ticks_);
  }
  double saturated() const noexcept {
    return static_cast<double>(saturated_) / static_cast<double>(std::max(tick_, 1L));
  }
  double standstill_rms() const noexcept {
    return still_ > 0 ? std::sqrt(std::max(still_x_, still_y_) / static_cast<double>(still_)) : 0;
  }
  bool stable(double saturation_limit) const noexcept {
    return tick_ == ticks_ && trip_ == Fault::none && standstill_rms() <= kLimitCycle &&
           saturated() <= saturation_limit;
  }

 private:
  double diverged_;
  long skip_, settle_, ticks_;
  long tick_ = 0, since_stop_ = 0, still_ = 0, saturated_ = 0, trip_tick_ = 0;
  double peak_ = 0, radial_ = 0, still_x_ = 0, still_y_ = 0;
  Fault trip_ = Fault::none;
};

}  // namespace whirl::tuning
