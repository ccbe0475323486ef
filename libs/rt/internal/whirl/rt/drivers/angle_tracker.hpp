#pragma once
#include <cmath>
#include <cstdint>
#include <numbers>

namespace whirl::rt {

/// Angle, speed and acceleration from an encoder's counter of 32 bits that wraps: fading-memory polynomial filter of
/// degree two (N. Morrison, Introduction to sequential smoothing and prediction, 1969, ch. 13), all three poles at q =
/// exp(-2 pi f h). Constant acceleration is followed without error. The angle itself is the counter's, not filtered.
class AngleTracker {
 public:
  /// `counts` per turn, with its sign; `bandwidth` f, Hz; `sample_time` h, s.
  AngleTracker(double counts, double bandwidth, double sample_time) noexcept
      : per_count_(2 * std::numbers::pi / counts),
        h_(sample_time),
        q_(std::exp(-2 * std::numbers::pi * bandwidth * sample_time)) {}

  /// `ticks` after the last: more than 1 where some were left out.
  void update(std::int32_t count, long ticks = 1) noexcept {
    const double h = h_ * static_cast<double>(ticks), q = ticks == 1 ? q_ : std::pow(q_, ticks);
    if (!started_) last_ = count, started_ = true;
    total_ += static_cast<std::int32_t>(static_cast<std::uint32_t>(count) - static_cast<std::uint32_t>(last_));
    last_ = count;
    smooth_ += h * (omega_ + 0.5 * h * omega_dot_);
    omega_ += h * omega_dot_;
    const double e = beta() - smooth_, p = 1 - q;
    smooth_ += (1 - q * q * q) * e;
    omega_ += 1.5 * p * p * (1 + q) / h * e;
    omega_dot_ += p * p * p / (h * h) * e;
  }
  double beta() const noexcept { return per_count_ * static_cast<double>(total_); }  ///< rad, continuous, 0 at first
  double omega() const noexcept { return omega_; }                                   ///< rad/s
  double omega_dot() const noexcept { return omega_dot_; }                           ///< rad/s^2

 private:
  double per_count_, h_, q_;
  double smooth_ = 0, omega_ = 0, omega_dot_ = 0;
  std::int64_t total_ = 0;
  std::int32_t last_ = 0;
  bool started_ = false;
};

}  // namespace whirl::rt
