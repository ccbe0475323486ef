#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "whirl/core/control_types.hpp"

namespace whirl::rt {

/// Force after a trip, and in ticks without a command: its part that turns with the rotor goes on and fades, instead of
/// stopping at once.
///
/// A controller near a critical speed holds the disk against the unbalance. When it lets go at once, the disk starts
/// from rest under the full unbalance, and the free vibration of the start adds to the forced one: up to 18 % above the
/// peak without control, on the virtual rig. When the force fades over some times 2 m / C, none is excited.
///
/// The force that holds the disk is minus the unbalance, which is known without any displacement sensor: while the loop
/// runs, each axis is fitted by u = a cos(beta) + b sin(beta) over the last tenth of a second (least squares with
/// forgetting). Afterwards
///
///     u(t) = (1 - (t - t0) / T) min(1, omega^2 / omega0^2) (a cos(beta) + b sin(beta)).
///
/// There is no feedback in it, so that a broken sensor cannot make it grow; a standing angle goes on with the last
/// speed and acceleration.
class SynchronousRelease {
 public:
  explicit SynchronousRelease(double sample_time) noexcept
      : sample_time_(sample_time), keep_(std::exp(-sample_time / kMemory)) {}

  /// Every cycle, before `learn` and `force`. `ticks`: since the last call.
  void follow(const Measurement& m, long ticks) noexcept {
    if (m.beta != measured_beta_ && std::isfinite(m.beta) && std::isfinite(m.omega) && std::isfinite(m.omega_dot)) {
      measured_beta_ = beta_ = m.beta;
      omega_ = m.omega;
      omega_dot_ = m.omega_dot;
      cos_ = std::cos(beta_);
      sin_ = std::sin(beta_);
    } else {
      turn(ticks);
    }
  }
  /// `ticks` go by without a reading.
  void turn(long ticks) noexcept {
    const double t = static_cast<double>(ticks) * sample_time_, before = omega_;
    beta_ += (omega_ + 0.5 * omega_dot_ * t) * t;
    omega_ += omega_dot_ * t;
    if (omega_ * before <= 0) omega_ = omega_dot_ = 0;  // it comes to rest and does not turn back
    cos_ = std::cos(beta_);
    sin_ = std::sin(beta_);
  }
  /// Nothing of the force before: the loop is armed anew. The angle is followed on.
  void forget() noexcept {
    cc_ = cs_ = ss_ = largest_ = 0;
    x_ = y_ = {};
    learnt_omega_ = 0;
  }
  /// The force sent for a valid sample.
  void learn(const Command& u) noexcept {
    cc_ = keep_ * cc_ + cos_ * cos_;
    cs_ = keep_ * cs_ + cos_ * sin_;
    ss_ = keep_ * ss_ + sin_ * sin_;
    x_ = {keep_ * x_[0] + u.ux * cos_, keep_ * x_[1] + u.ux * sin_};
    y_ = {keep_ * y_[0] + u.uy * cos_, keep_ * y_[1] + u.uy * sin_};
    learnt_omega_ = omega_;
    largest_ = std::max({largest_, std::abs(u.ux), std::abs(u.uy)});
  }
  /// `fade` 1 to 0.
  Command force(double fade) const noexcept {
    // At standstill the angle shows one direction only; the ridge leaves the other out.
    const double ridge = 1e-6 * (cc_ + ss_) + 1e-30;
    const double cc = cc_ + ridge, ss = ss_ + ridge, det = cc * ss - cs_ * cs_;
    const double ratio = learnt_omega_ != 0 ? omega_ / learnt_omega_ : 1;
    const double g = fade * std::min(1.0, ratio * ratio);
    // Few samples do not show what turns: no fit is larger than that of a square wave of the largest force.
    const double most = g * kSquareWave * largest_;
    const auto axis = [&](const std::array<double, 2>& r) {
      const double fit = g / det * ((ss * r[0] - cs_ * r[1]) * cos_ + (cc * r[1] - cs_ * r[0]) * sin_);
      return std::clamp(fit, -most, most);
    };
    return {axis(x_), axis(y_)};
  }

 private:
  static constexpr double kMemory = 0.1;                           // s
  static constexpr double kSquareWave = 4 * std::numbers::inv_pi;  // its first harmonic
  double sample_time_, keep_;
  double measured_beta_ = 0, beta_ = 0, omega_ = 0, omega_dot_ = 0, learnt_omega_ = 0;
  double cos_ = 1, sin_ = 0;
  double cc_ = 0, cs_ = 0, ss_ = 0, largest_ = 0;  // of all since forget(): N, of an axis
  std::array<double, 2> x_{}, y_{};
};

}  // namespace whirl::rt
