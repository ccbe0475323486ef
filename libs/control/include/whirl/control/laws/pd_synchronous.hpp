#pragma once
#include <complex>

#include "whirl/control/lateral_model.hpp"
#include "whirl/control/laws/pd.hpp"

namespace whirl::control {

/// Adaptive cancellation of the synchronous (1x) motion on top of a PD loop: the industry's methods, in the
/// complex coordinate, where forward whirl is one phasor. The force is kept as an eccentricity q, so that it
/// scales with the speed:
///   a = q F(beta at effect),  F = e^{i beta}(omega^2 - i alpha),
///   G(omega) = omega^2 / (k1 - omega^2 + i omega c + (kp + i omega kd) e^{-i omega tau})   (m of motion per
///   m of q).
/// With X the synchronous phasor of the displacement z = X e^{i beta}:
///   influence  once per turn q -= mu X / G            (influence coefficients; converges for 0 < mu < 2
///   cos(phase error)) fxlms      q -= h mu conj(G) z e^{-i beta}        (filtered-x LMS in quadrature) notch
///   q -= h mu e^{-i arg G} z e^{-i beta}   (generalised notch, Herzog 1996, phase scheduled over speed)
/// All need the phase of G within 90 degrees. Adaptation freezes below `omega_min`.
class SynchronousCanceller {
 public:
  enum class Method { influence, fxlms, notch };

  SynchronousCanceller() = default;
  SynchronousCanceller(Method method, double rate, double kp, double kd, const LateralModel& model, double delay,
                       double sample_time, double omega_min) noexcept;

  /// z, beta at the time of the sample; `forcing` = F at the time of effect. `adapt` false: sample lost or
  /// force at its limit.
  std::complex<double> step(std::complex<double> z, double beta, double omega, std::complex<double> forcing,
                            bool adapt) noexcept;
  void reset() noexcept;
  std::complex<double> eccentricity() const noexcept { return q_; }  ///< q, tends to -eps
  std::complex<double> response(double omega) const noexcept;        ///< G

 private:
  Method method_ = Method::influence;
  double rate_ = 0, kp_ = 0, kd_ = 0, k1_ = 0, c_ = 0, delay_ = 0, h_ = 0, omega_min_ = 0;
  std::complex<double> q_, sum_;
  long count_ = 0;
  double turn_start_ = 0;
};

/// PD per axis plus a canceller of the synchronous motion.
struct SynchronousPd {
  Pd x, y;
  SynchronousCanceller synchronous;
};

}  // namespace whirl::control
