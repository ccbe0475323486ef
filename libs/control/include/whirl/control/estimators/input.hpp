#pragma once
#include <complex>
#include <optional>

#include "whirl/control/lateral_model.hpp"

namespace whirl::control {

/// How far the rotor turns in parts of a sample, e^{i angle}.
struct SampleTurns {
  std::complex<double> quarter, half;
  std::complex<double> first, second;  ///< in half of each of the two pieces of control

  SampleTurns(double omega, double split, double h) noexcept
      : quarter(unit_phasor(0.25 * omega * h)),
        half(product(quarter, quarter)),
        first(split > 0 ? unit_phasor(0.5 * omega * split * h) : 1),
        second(split > 0 ? product(half, std::conj(first)) : half) {}
};

/// What an estimator receives once per sample. "Sensor time" is the instant at which the displacement was
/// taken: the tick minus the sensor delay. The control acceleration over the last interval is piecewise
/// constant because the loop delay is not a whole number of samples.
struct EstimatorInput {
  std::complex<double> z;  ///< displacement, m; the held value when not fresh
  bool fresh = true;       ///< false: the sample was lost
  std::complex<double> a_first,
      a_second;                  ///< control acceleration over the first `split` h and the rest, m/s^2
  double split = 0;              ///< in [0, 1)
  std::complex<double> forcing;  ///< unbalance_per_metre at this sample, rad^2/s^2
  std::complex<double> d;        ///< the model's unbalance acceleration at this sample, m/s^2 (0 without feedforward)
  double omega = 0;              ///< rad/s
  std::optional<SampleTurns> turns;  ///< where the caller has them
};

/// Prediction over one sample interval h with the two pieces of control.
inline DiskMotion predict_interval(const LateralModel& model, const DiskMotion& s, const EstimatorInput& in,
                                   double h) noexcept {
  const SampleTurns turns = in.turns ? *in.turns : SampleTurns(in.omega, in.split, h);
  MotionPrediction p(model, s);
  if (in.split > 0) p.step(in.a_first, turns.first, in.split * h);
  p.step(in.a_second, turns.second, (1 - in.split) * h);
  return p.motion();
}

}  // namespace whirl::control
