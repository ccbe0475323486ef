#pragma once
#include <algorithm>
#include <cmath>
#include <complex>

#include "whirl/control/lateral_model.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {

/// Finds motion that stands beside the synchronous one: the readings less their offset, their forward and their
/// backward 1x part, each tracked by a notch; what is left, as a running rms, must not stay above the limit without
/// decaying. Transients decay and pass; limit cycles and growth do not.
class StandingMotion {
 public:
  StandingMotion(double rate, double start, const VerdictLimits& limits) noexcept
      : offset_gain_(kOffsetRate / rate),
        notch_gain_(kNotchRate / rate),
        level_gain_(1 / (kLevelTime * rate)),
        start_(std::lround(start * rate)),
        half_(std::max(1L, std::lround(0.5 * limits.standing_time * rate))),
        floor_(limits.standing_rms),
        share_(limits.standing_share),
        rate_(rate) {}

  /// One reading of a turning shaft, m, and its angle, rad.
  void reading(std::complex<double> z, double beta) noexcept { turned(z, control::unit_phasor(beta)); }
  /// The same with e^{i beta}.
  void turned(std::complex<double> z, std::complex<double> turn) noexcept {
    using control::product;
    if (tick_ == 0) forward_ = product(z, std::conj(turn));
    const std::complex<double> rest = z - offset_ - product(forward_, turn) - product(backward_, std::conj(turn));
    offset_ += offset_gain_ * rest;
    forward_ += notch_gain_ * product(rest, std::conj(turn));
    backward_ += notch_gain_ * product(rest, turn);
    if (tick_++ < start_) return;
    square_ += level_gain_ * (std::norm(rest) - square_);
    // rms of one axis, as at standstill
    if (0.5 * square_ <= std::max(floor_ * floor_, share_ * share_ * std::norm(forward_))) {
      above_ = 0;
      return;
    }
    const double level = std::sqrt(0.5 * square_);
    if (above_ % half_ == 0) {
      // Above the limit for the whole time and not lower by 40 % than half of it ago.
      if (above_ >= 2 * half_ && level > kDecayed * mark_ && level > rms_) {
        rms_ = level;
        time_ = static_cast<double>(tick_) / rate_;
      }
      mark_ = level;
    }
    ++above_;
  }
  double rms() const noexcept { return rms_; }    ///< m; 0: nothing stands
  double time() const noexcept { return time_; }  ///< s

 private:
  static constexpr double kOffsetRate = 5, kNotchRate = 20;  ///< 1/s
  static constexpr double kLevelTime = 0.2;                  ///< s
  static constexpr double kDecayed = 0.6;
  double offset_gain_, notch_gain_, level_gain_;
  long start_, half_, tick_ = 0, above_ = 0;
  double floor_, share_, rate_;
  std::complex<double> offset_, forward_, backward_;
  double square_ = 0, mark_ = 0, rms_ = 0, time_ = 0;
};

}  // namespace whirl::tuning
