#include "whirl/control/estimators.hpp"

namespace whirl::control {

FilteredDifference::FilteredDifference(double cutoff_hz, double sample_time) noexcept
    : pole_(std::exp(-2 * std::numbers::pi * cutoff_hz * sample_time)), h_(sample_time) {}

DiskMotion FilteredDifference::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    // A rotor in steady whirl moves at i omega z: the best guess from one sample.
    v_ = product({0, in.omega}, in.z);
    started_ = true;
  } else {
    v_ = pole_ * v_ + (1 - pole_) / h_ * (in.z - last_);
  }
  last_ = in.z;
  return {in.z, v_, in.d};
}

double RobustDifferentiator::explicit_step(double y, double h) noexcept {
  const double e = x - y, k1 = 1.5 * std::sqrt(rate), k2 = 1.1 * rate;
  x += h * (w - k1 * sig(e, 0.5));
  w -= h * k2 * sgn(e);
  return w;
}

double RobustDifferentiator::implicit_step(double y, double h) noexcept {
  const double k1 = 1.5 * std::sqrt(rate), k2 = 1.1 * rate, b = y - x - h * w;
  if (std::abs(b) <= h * h * k2) {
    w += b / h;
    x = y;
  } else {
    const double excess = std::abs(b) - h * h * k2;
    const double q = 2 * excess / (h * k1 + std::sqrt(h * h * k1 * k1 + 4 * excess));
    w += h * k2 * sgn(b);
    x = y - q * q * sgn(b);
  }
  return w;
}

LevantDifferentiator::LevantDifferentiator(double rate, double sample_time, bool implicit) noexcept
    : x_{rate}, y_{rate}, h_(sample_time), implicit_(implicit) {}

void LevantDifferentiator::reset() noexcept {
  x_ = {x_.rate};
  y_ = {y_.rate};
  started_ = false;
}

DiskMotion LevantDifferentiator::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    const std::complex<double> v = product({0, in.omega}, in.z);
    x_.x = in.z.real();
    y_.x = in.z.imag();
    x_.w = v.real();
    y_.w = v.imag();
    started_ = true;
    return {in.z, v, in.d};
  }
  if (implicit_) return {in.z, {x_.implicit_step(in.z.real(), h_), y_.implicit_step(in.z.imag(), h_)}, in.d};
  return {in.z, {x_.explicit_step(in.z.real(), h_), y_.explicit_step(in.z.imag(), h_)}, in.d};
}

ExtendedStateObserver::ExtendedStateObserver(const LateralModel& model, double bandwidth, double sample_time) noexcept
    : model_(model), h_(sample_time) {
  const double lam = std::exp(-bandwidth * h_);
  l1_ = 1 - lam * lam * lam;
  l2_ = 3 * (1 - lam) * (1 - lam) * (1 + lam) / (2 * h_);
  l3_ = (1 - lam) * (1 - lam) * (1 - lam) / (h_ * h_);
}

namespace {
/// Prediction over one interval with the two pieces of control.
DiskMotion predict_interval(const LateralModel& model, const DiskMotion& s, const EstimatorInput& in, double h) {
  const DiskMotion first = in.split > 0 ? predict_motion(model, s, in.a_first, in.omega, in.split * h) : s;
  return predict_motion(model, first, in.a_second, in.omega, (1 - in.split) * h);
}
}  // namespace

DiskMotion ExtendedStateObserver::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    state_ = {in.z, product({0, in.omega}, in.z), in.d};
    started_ = true;
    return state_;
  }
  state_ = predict_interval(model_, state_, in, h_);
  if (in.fresh) {
    const std::complex<double> e = in.z - state_.z;
    state_.z += l1_ * e;
    state_.v += l2_ * e;
    state_.d += l3_ * e;
  }
  return state_;
}

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
  const std::complex<double> b0 = 0.5 * h * h * g, b1 = h * (1 - 0.5 * c * h) * g;
  const double f00 = 1 - 0.5 * k * h * h, f01 = h - 0.5 * c * h * h, f10 = -k * h * (1 - 0.5 * c * h),
               f11 = 1 - c * h + 0.5 * (c * c - k) * h * h;
  // F P with F = [f00 f01 b0; f10 f11 b1; 0 0 1], then (F P) F^H; P is Hermitian, so the lower half is a
  // copy.
  const std::complex<double> p01 = p01_, p02 = p02_, p12 = p12_;
  const double p00 = p00_, p11 = p11_, p22 = p22_;
  const std::complex<double> m00 = f00 * p00 + f01 * std::conj(p01) + product(b0, std::conj(p02));
  const std::complex<double> m01 = f00 * p01 + f01 * p11 + product(b0, std::conj(p12));
  const std::complex<double> m02 = f00 * p02 + f01 * p12 + b0 * p22;
  const std::complex<double> m10 = f10 * p00 + f11 * std::conj(p01) + product(b1, std::conj(p02));
  const std::complex<double> m11 = f10 * p01 + f11 * p11 + product(b1, std::conj(p12));
  const std::complex<double> m12 = f10 * p02 + f11 * p12 + b1 * p22;
  const double q = options_.acceleration_noise * options_.acceleration_noise * h * h;
  const double walk = options_.disturbance_walk * options_.disturbance_walk * h;
  p00_ = (f00 * m00 + f01 * m01 + product(m02, std::conj(b0))).real() + 0.25 * h * h * q;
  p01_ = f10 * m00 + f11 * m01 + product(m02, std::conj(b1)) + 0.5 * h * q;
  p02_ = m02;
  p11_ = (f10 * m10 + f11 * m11 + product(m12, std::conj(b1))).real() + q;
  p12_ = m12;
  p22_ = p22 + (kind_ == DisturbanceState::none ? 0 : walk);
}

DiskMotion KalmanEstimator::step(const EstimatorInput& in) noexcept {
  if (!started_) {
    start(in);
    state_.d = kind_ == DisturbanceState::none ? in.d : product(theta_, g_);
    return state_;
  }
  phase_ = std::remainder(phase_ + in.omega * h_, 2 * std::numbers::pi);
  const std::complex<double> g_new = regressor(in);
  // The regressor half-way: the mean of the ends, exact to (omega h)^2 / 8 and used in the covariance only.
  predict_covariance(0.5 * (g_ + g_new));
  state_ = predict_interval(model_, state_, in, h_);
  g_ = g_new;
  if (in.fresh) {
    const double r = options_.measurement_noise, s = p00_ + r * r;
    const std::complex<double> k0 = p00_ / s, k1 = std::conj(p01_) / s, k2 = std::conj(p02_) / s;
    const std::complex<double> e = in.z - state_.z;
    state_.z += product(k0, e);
    state_.v += product(k1, e);
    theta_ += product(k2, e);
    // P - K S K^H, Hermitian by construction.
    p22_ -= std::norm(k2) * s;
    p12_ -= product(k1, std::conj(k2)) * s;
    p11_ -= std::norm(k1) * s;
    p02_ -= product(k0, std::conj(k2)) * s;
    p01_ -= product(k0, std::conj(k1)) * s;
    p00_ -= std::norm(k0) * s;
  }
  state_.d = kind_ == DisturbanceState::none ? in.d : product(theta_, g_);
  return state_;
}

}  // namespace whirl::control
