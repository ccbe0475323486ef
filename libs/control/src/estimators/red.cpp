#include "whirl/control/estimators/red.hpp"

#include "whirl/control/method.hpp"

namespace whirl::control {

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

namespace {

const ParameterInfo kRate{"derivative_rate", "m/s^2", "L, bound of |x''|", 20, 1e-3, 1e6, 2, 500};

}  // namespace

EstimatorEntry red_estimator() {
  return {.info = {"red", "robust exact differentiator, explicit", "Levant 1998", {kRate}},
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyEstimator {
            return LevantDifferentiator(v.at("derivative_rate"), d.sample_time, false);
          },
          .code = [](const Parameters&) { return CodeFragment{"red"}; }};
}

EstimatorEntry red_implicit_estimator() {
  return {
      .info = {"red_implicit", "robust exact differentiator, implicit", "Brogliato, Polyakov, Efimov 2020", {kRate}},
      .make = [](const ControllerDesign& d, const Parameters& v) -> AnyEstimator {
        return LevantDifferentiator(v.at("derivative_rate"), d.sample_time, true);
      },
      .code =
          [](const Parameters&) {
            return CodeFragment{"red", {"IMPLICIT"}};
          }};
}

}  // namespace whirl::control
