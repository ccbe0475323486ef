#pragma once
#include <array>
#include <complex>

#include "whirl/control/lateral_model.hpp"
#include "whirl/control/laws/pd.hpp"

namespace whirl::control {

/// Filtered-x LMS at 1x over both axes: two probes, two actuators, one complex weight each. The weights w are kept as
/// eccentricities, so that the force scales with the speed:
///   a_x = Re(w_x F),  a_y = Re(w_y F),  F = e^{i beta}(omega^2 - i alpha),
///   w <- w - h mu G^H E / lambda,  E = 2 (x, y) e^{-i beta},  lambda the largest eigenvalue of G^H G,
///   G = omega^2 ((K - omega^2 + i omega C) + (kp + i omega kd) e^{-i omega tau})^{-1}
/// with the model's stiffness K and damping C of both axes: forward and backward whirl of a rotor whose axes differ.
/// lambda makes mu the rate at which what both axes see best dies away, at every speed: steps stay stable for
/// h mu < 2 as far as the response is that of the model (phase within 90 degrees). Source: Elliott, Stothers, Nelson,
/// IEEE Trans. ASSP 35 (1987) 1423, with the normalised step of its convergence bound.
class MultiChannelLms {
 public:
  using Complex = std::complex<double>;
  /// Response of both axes to both weights: G_xx, G_xy = G_yx, G_yy.
  struct Response {
    Complex xx, xy, yy;
    double largest = 0;  ///< lambda
  };
  MultiChannelLms() = default;
  MultiChannelLms(double rate, double kp, double kd, const LateralModel& model, double delay, double sample_time,
                  double omega_min) noexcept
      : model_(model), rate_(rate), kp_(kp), kd_(kd), delay_(delay), h_(sample_time), omega_min_(omega_min) {}

  /// z, beta at the time of the sample; `forcing` = F at the time of effect. `adapt` false: sample lost or
  /// force at its limit.
  Complex step(Complex z, double beta, double omega, Complex forcing, bool adapt) noexcept;
  void reset() noexcept { w_ = {}; }
  const std::array<Complex, 2>& weights() const noexcept { return w_; }  ///< tend to -eps, i eps
  Response response(double omega) const noexcept;

 private:
  LateralModel model_;
  double rate_ = 0, kp_ = 0, kd_ = 0, delay_ = 0, h_ = 0, omega_min_ = 0;
  std::array<Complex, 2> w_{};
};

/// PD per axis plus that adaptation.
struct MultiChannelPd {
  Pd x, y;
  MultiChannelLms synchronous;
};

}  // namespace whirl::control
