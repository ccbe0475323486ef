#include "whirl/diagnosis/balancing.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::diagnosis {

BalancingAdvice balancing_advice(const RotorModel& model, double mass, double radius, double service_speed,
                                 double wanted_grade, const std::vector<double>& covariance) {
  require_range("mass", mass, 1e-9, 1e9, "kg");
  require_range("radius", radius, 1e-6, 1e3, "m");
  require_range("service_speed", service_speed, 1e-6, 1e6, "rad/s");
  require_range("wanted_grade", wanted_grade, 1e-3, 1e5, "mm/s");
  BalancingAdvice a;
  const double e = std::abs(model.eps);
  a.unbalance = mass * e;
  a.heavy_angle = std::arg(model.eps);
  a.correction_mass = a.unbalance / radius;
  a.correction_angle = std::arg(-model.eps);
  a.grade = 1e3 * e * service_speed;
  a.permitted_unbalance = mass * wanted_grade * 1e-3 / service_speed;
  a.within_grade = a.grade <= wanted_grade;
  if (covariance.size() == 25 && e > 0) {
    // (k1, k2, c, eps_re, eps_im): along the vector the magnitude, across it the angle.
    const double re = covariance[18], im = covariance[24], cross = covariance[19];
    const double c = model.eps.real() / e, s = model.eps.imag() / e;
    const double along = std::sqrt(std::max(c * c * re + 2 * c * s * cross + s * s * im, 0.0));
    const double across = std::sqrt(std::max(s * s * re - 2 * c * s * cross + c * c * im, 0.0));
    a.mass_interval = Estimate::from_sd(a.correction_mass, mass * along / radius);
    a.angle_interval = Estimate::from_sd(a.correction_angle, across / e);
  }
  return a;
}

}  // namespace whirl::diagnosis
