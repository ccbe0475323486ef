#include "whirl/control/estimators/kalman.hpp"

#include "whirl/control/method.hpp"

namespace whirl::control {

KalmanEstimator::KalmanEstimator(const LateralModel& model, DisturbanceState disturbance, std::complex<double> eps,
                                 const KalmanOptions& options, double sample_time) noexcept
    : model_(model), options_(options), eps_(eps), h_(sample_time), kind_(disturbance) {}

std::complex<double> KalmanEstimator::regressor(const EstimatorInput& in) const noexcept {
  switch (kind_) {
    case DisturbanceState::none:
      return {};
    case DisturbanceState::eccentricity:
      return in.forcing;
    case DisturbanceState::oscillator:
      return unit_phasor(phase_);
  }
  return {};
}

void KalmanEstimator::start(const EstimatorInput& in) noexcept {
  const double r = options_.measurement_noise, whirl = std::abs(in.omega) * std::abs(in.z);
  state_ = {in.z, product({0, in.omega}, in.z), {}};
  theta_ = kind_ == DisturbanceState::eccentricity ? eps_ : 0.0;
  phase_ = 0;
  g_ = regressor(in);
  p01_ = p02_ = p12_ = 0;
  p00_ = r * r;
  p11_ = whirl * whirl + 1e-4;  // 10 mm/s when nothing is known
  p22_ = kind_ == DisturbanceState::none ? 0 : options_.disturbance_prior * options_.disturbance_prior;
  started_ = true;
}

void KalmanEstimator::predict_covariance(std::complex<double> g) noexcept {
  const double k = model_.k1 + 2 * model_.k2 * std::norm(state_.z), c = model_.c, h = h_;
  // The disturbance acts along g in both rows.
  const double b0 = 0.5 * h * h, b1 = h * (1 - 0.5 * c * h);
  const double f00 = 1 - 0.5 * k * h * h, f01 = h - 0.5 * c * h * h, f10 = -k * h * (1 - 0.5 * c * h),
               f11 = 1 - c * h + 0.5 * (c * c - k) * h * h;
  // M = F P with F = [f00 f01 b0 g; f10 f11 b1 g; 0 0 1], then M F^H; P is Hermitian, so of its diagonal the real part
  // and of the rest one half is all there is.
  const std::complex<double> p01 = p01_, p02 = p02_, p12 = p12_;
  const double p00 = p00_, p11 = p11_, p22 = p22_;
  const std::complex<double> g02 = product(g, std::conj(p02)), g12 = product(g, std::conj(p12)), g22 = p22 * g;
  const std::complex<double> m00 = f00 * p00 + f01 * std::conj(p01) + b0 * g02, m01 = f00 * p01 + f01 * p11 + b0 * g12,
                             m02 = f00 * p02 + f01 * p12 + b0 * g22, m12 = f10 * p02 + f11 * p12 + b1 * g22;
  const double m10 = f10 * p00 + f11 * p01.real() + b1 * g02.real(),
               m11 = f10 * p01.real() + f11 * p11 + b1 * g12.real();
  const std::complex<double> turned02 = product(m02, std::conj(g)), turned12 = product(m12, std::conj(g));
  const double q = options_.acceleration_noise * options_.acceleration_noise * h * h;
  const double walk = options_.disturbance_walk * options_.disturbance_walk * h;
  p00_ = f00 * m00.real() + f01 * m01.real() + b0 * turned02.real() + 0.25 * h * h * q;
  p01_ = f10 * m00 + f11 * m01 + b1 * turned02 + 0.5 * h * q;
  p02_ = m02;
  p11_ = f10 * m10 + f11 * m11 + b1 * turned12.real() + q;
  p12_ = m12;
  p22_ = p22 + (kind_ == DisturbanceState::none ? 0 : walk);
}

DiskMotion KalmanEstimator::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    start(in);
    state_.d = kind_ == DisturbanceState::none ? in.d : product(theta_, g_);
    return state_;
  }
  if (kind_ == DisturbanceState::oscillator) {
    phase_ = std::remainder(phase_ + in.omega * h_, 2 * std::numbers::pi);
  }
  const std::complex<double> g_new = regressor(in);
  // The regressor half-way: the mean of the ends, exact to (omega h)^2 / 8 and used in the covariance only.
  predict_covariance(0.5 * (g_ + g_new));
  state_ = predict_interval(model_, state_, in, h_);
  g_ = g_new;
  if (in.fresh) {
    const double r = options_.measurement_noise, s = p00_ + r * r, per = 1 / s;
    const double k0 = p00_ * per;
    const std::complex<double> k1 = per * std::conj(p01_), k2 = per * std::conj(p02_);
    const std::complex<double> e = in.z - state_.z;
    state_.z += k0 * e;
    state_.v += product(k1, e);
    theta_ += product(k2, e);
    // P - K S K^H, Hermitian by construction.
    p22_ -= std::norm(k2) * s;
    p12_ -= product(k1, std::conj(k2)) * s;
    p11_ -= std::norm(k1) * s;
    p02_ -= k0 * s * std::conj(k2);
    p01_ -= k0 * s * std::conj(k1);
    p00_ -= k0 * k0 * s;
  }
  state_.d = kind_ == DisturbanceState::none ? in.d : product(theta_, g_);
  return state_;
}

namespace {

const ParameterInfo kReading{
    "measurement_noise", "m", "rms noise of a displacement reading, runout included", 1.2e-6, 1e-9, 1e-2, 0, 0};
const ParameterInfo kLeftOut{"acceleration_noise",
                             "m/s^2",
                             "rms of the acceleration the model leaves out, per sample",
                             0.5,
                             1e-6,
                             1e4,
                             0.02,
                             20};

AnyEstimator make(const ControllerDesign& d, const Parameters& v, DisturbanceState kind, double walk, double prior) {
  return KalmanEstimator(LateralModel::from(d.model), kind, d.model.eps,
                         {v.at("measurement_noise"), v.at("acceleration_noise"), walk, prior}, d.sample_time);
}

}  // namespace

EstimatorEntry kalman_estimator() {
  return {
      .info = {"kalman", "Kalman filter, position and velocity", "model-based prediction", {kReading, kLeftOut}},
      .make = [](const ControllerDesign& d, const Parameters& v) { return make(d, v, DisturbanceState::none, 0, 0); },
      .code =
          [](const Parameters&) {
            return CodeFragment{"kalman", {"NO_FORCING"}, {{"kalman", "(z, v)"}}};
          },
      .model_based = true,
      .knows_noise = true};
}

EstimatorEntry kfe_estimator() {
  return {.info = {"kfe",
                   "Kalman filter with the eccentricity as states",
                   "model-based prediction; needs the angle",
                   {kReading,
                    kLeftOut,
                    {"eccentricity_walk", "m/sqrt(s)", "random walk of the eccentricity", 2e-5, 0, 1, 2e-6, 2e-3},
                    {"eccentricity_prior", "m", "sd of the model's eccentricity at the start", 1e-4, 0, 1, 0, 0}}},
          .make =
              [](const ControllerDesign& d, const Parameters& v) {
                return make(d, v, DisturbanceState::eccentricity, v.at("eccentricity_walk"),
                            v.at("eccentricity_prior"));
              },
          .code =
              [](const Parameters&) {
                return CodeFragment{"kalman",
                                    {"THIRD"},
                                    {{"kalman", "(z, v, eccentricity)"},
                                     {"theta", "m, eccentricity"},
                                     {"walk", "eccentricity_walk"},
                                     {"prior", "eccentricity_prior"}}};
              },
          .model_based = true,
          .finds_disturbance = true,
          .knows_noise = true};
}

EstimatorEntry kfo_estimator() {
  return {
      .info = {"kfo",
               "Kalman filter with an oscillator at the speed",
               "model-based prediction; needs the speed only",
               {kReading,
                kLeftOut,
                {"oscillator_walk", "m/s^2/sqrt(s)", "random walk of the disturbance amplitude", 1, 0, 1e4, 0.05, 50},
                {"oscillator_prior", "m/s^2", "sd of the disturbance at the start", 5, 0, 1e4, 0, 0}}},
      .make =
          [](const ControllerDesign& d, const Parameters& v) {
            return make(d, v, DisturbanceState::oscillator, v.at("oscillator_walk"), v.at("oscillator_prior"));
          },
      .code =
          [](const Parameters&) {
            return CodeFragment{"kalman",
                                {"THIRD", "OSCILLATOR", "NO_FORCING"},
                                {{"kalman", "(z, v, disturbance amplitude)"},
                                 {"theta", "m/s^2, amplitude of the disturbance"},
                                 {"walk", "oscillator_walk"},
                                 {"prior", "oscillator_prior"}}};
          },
      .model_based = true,
      .finds_disturbance = true,
      .knows_noise = true};
}

}  // namespace whirl::control
