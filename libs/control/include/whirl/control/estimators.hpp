#pragma once
#include <complex>

#include "whirl/control/lateral_model.hpp"
#include "whirl/control/power.hpp"

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

/// Backward difference with a first-order low-pass: v[k] = q v[k-1] + (1 - q)(z[k] - z[k-1])/h, q = exp(-2 pi
/// fc h); fc infinite (q = 0) gives the plain difference. Delay h/2 plus 1/(2 pi fc).
class FilteredDifference {
 public:
  FilteredDifference(double cutoff_hz, double sample_time) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept {
    started_ = false;
    v_ = {};
  }

 private:
  double pole_, h_;
  std::complex<double> last_, v_;
  bool started_ = false;
};

/// One axis of Levant's robust exact differentiator of order 1: converges in finite time when |y''| <= L.
///   x_e' = w - k1 sig(x_e - y)^(1/2),  w' = -k2 sgn(x_e - y),  k1 = 1.5 sqrt(L),  k2 = 1.1 L;  w is the
///   derivative.
struct RobustDifferentiator {
  double rate = 100;  ///< L, m/s^2
  double x = 0, w = 0;

  double explicit_step(double y, double h) noexcept;  ///< forward Euler: chatters by O(L h)
  double implicit_step(double y, double h) noexcept;  ///< backward Euler solved exactly: no chatter
};

class LevantDifferentiator {
 public:
  LevantDifferentiator(double rate, double sample_time, bool implicit) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept;

 private:
  RobustDifferentiator x_, y_;
  double h_;
  bool implicit_, started_ = false;
};

/// Linear extended state observer (Gao 2003; discrete current form of Miklosovic, Radke, Gao, ACC 2006), all
/// three poles at exp(-w h). States z, v and the disturbance the model does not explain; in the rotor form
/// that disturbance turns with the rotor (at standstill this is the classical constant one).
class ExtendedStateObserver {
 public:
  ExtendedStateObserver(const LateralModel& model, double bandwidth, double sample_time) noexcept;
  DiskMotion step(const EstimatorInput& in) noexcept;
  void reset() noexcept {
    started_ = false;
    state_ = {};
  }

 private:
  LateralModel model_;
  double h_, l1_, l2_, l3_;
  DiskMotion state_;
  double last_omega_ = 0;
  bool started_ = false;
};

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
