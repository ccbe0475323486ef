#pragma once
#include "whirl/control/estimators/input.hpp"

namespace whirl::control {

/// Noise levels of the Kalman estimators.
struct KalmanOptions {
  double measurement_noise = 1.2e-6;  ///< m rms of one displacement reading
  double acceleration_noise = 0.5;    ///< m/s^2 rms, white per sample: what the model leaves out
  double disturbance_walk = 0;        ///< of the third state: m/sqrt(s) (eccentricity), m/s^2/sqrt(s) (oscillator)
  double disturbance_prior = 1e-4;    ///< sd of the third state at the start, m or m/s^2
};

/// What the third Kalman state is.
enum class DisturbanceState {
  none,          ///< [z v]: the model's unbalance, when given, is an input
  eccentricity,  ///< [z v eps]: d = eps e^{i beta}(omega^2 - i alpha); needs the angle; starts at the model's
                 ///< eps
  oscillator,    ///< [z v q]: d = q e^{i phi}, phi' = omega; needs the speed only
};

/// Kalman filter in the complex coordinate: nonlinear prediction with the identified model and the force that
/// really acted, linearised covariance (isotropic part), gain updated every sample because the disturbance
/// column turns.
class KalmanEstimator {
 public:
  KalmanEstimator(const LateralModel& model, DisturbanceState disturbance, std::complex<double> eps,
                  const KalmanOptions& options, double sample_time) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept { started_ = false; }
  std::complex<double> disturbance_parameter() const noexcept { return theta_; }  ///< eps or q

 private:
  void start(const EstimatorInput& in) noexcept;
  void predict_covariance(std::complex<double> g) noexcept;
  std::complex<double> regressor(const EstimatorInput& in) const noexcept;

  LateralModel model_;
  KalmanOptions options_;
  std::complex<double> eps_;
  double h_;
  DisturbanceState kind_;
  DiskMotion state_;
  std::complex<double> theta_, g_;  ///< third state and its regressor at the last sample
  double phase_ = 0;
  double p00_ = 0, p11_ = 0, p22_ = 0;  ///< covariance of (z, v, theta), Hermitian
  std::complex<double> p01_, p02_, p12_;
  bool started_ = false;
};

}  // namespace whirl::control
