#pragma once
#include <complex>

#include "whirl/control/lateral_model.hpp"

namespace whirl::control {

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
};

/// Prediction over one sample interval h with the two pieces of control.
inline DiskMotion predict_interval(const LateralModel& model, const DiskMotion& s, const EstimatorInput& in,
                                   double h) noexcept {
  const DiskMotion first = in.split > 0 ? predict_motion(model, s, in.a_first, in.omega, in.split * h) : s;
  return predict_motion(model, first, in.a_second, in.omega, (1 - in.split) * h);
}

}  // namespace whirl::control
