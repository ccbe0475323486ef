#include "whirl/diagnosis/unbalance_budget.hpp"

#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::diagnosis {

using Eigen::Index;

double permissible_unbalance(double grade, double mass, double speed) {
  require_range("grade", grade, 1e-3, 1e5, "mm/s");
  require_range("mass", mass, 1e-9, 1e9, "kg");
  require_range("speed", speed, 1e-6, 1e6, "rad/s");
  return mass * grade * 1e-3 / speed;
}

PlaneBudget unbalance_budget(Index plane, const Eigen::VectorXcd& best, const CorrectionUncertainty& uncertainty,
                             const Eigen::VectorXcd& on, double radius, const PlacingErrors& errors, double permitted) {
  require_range("radius", radius, 1e-6, 1e3, "m");
  require_range("mass error", errors.mass, 0, 1e6, "kg");
  require_range("angle error", errors.angle, 0, 7, "rad");
  require_range("radius error", errors.radius, 0, 1e3, "m");
  PlaneBudget b;
  const double mass = std::abs(on[plane]);
  b.residual = radius * std::abs(on[plane] - best[plane]);
  const Index q = best.size() + plane;
  const double a = uncertainty.covariance(plane, plane), d = uncertainty.covariance(q, q),
               c = uncertainty.covariance(plane, q);
  // The wider axis of the ellipse: the error may point anywhere.
  b.scatter = radius * uncertainty.quantile * std::sqrt((a + d) / 2 + std::hypot((a - d) / 2, c));
  if (mass > 0) {
    b.mass = radius * errors.mass;
    b.angle = radius * mass * 2 * std::sin(std::min(errors.angle, 3.141592653589793) / 2);
    b.radius = mass * errors.radius;
  }
  b.error = std::sqrt(b.scatter * b.scatter + b.mass * b.mass + b.angle * b.angle + b.radius * b.radius);
  b.permitted = permitted;
  if (b.residual + b.error <= permitted) b.tolerance = Tolerance::held;
  if (b.residual - b.error > permitted) b.tolerance = Tolerance::not_held;
  return b;
}

}  // namespace whirl::diagnosis
