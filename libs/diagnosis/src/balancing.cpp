#include "whirl/diagnosis/balancing.hpp"

#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::diagnosis {

BalancingAdvice balancing_advice(const RotorModel& model, double mass, double radius, double service_speed,
                                 double wanted_grade) {
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
  return a;
}

}  // namespace whirl::diagnosis
