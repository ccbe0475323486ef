#include "whirl/control/laws.hpp"

namespace whirl::control {

double solve_implicit_power(double x, double g, double exponent) noexcept {
  const double target = std::abs(x);
  if (!(target > 0) || g <= 0) return x;
  if (exponent == 0.5) {
    const double root = 2 * target / (g + std::sqrt(g * g + 4 * target));  // no cancellation for small x
    return std::copysign(root * root, x);
  }
  // In w = z^r the equation w^(1/r) + g w = |x| is convex and increasing: Newton from above cannot overshoot.
  const double power = 1 / exponent;
  double w = std::min(target / g, std::pow(target, exponent));
  for (int i = 0; i < 16; ++i) {
    const double lead = std::pow(w, power - 1);
    const double next = w - (lead * w + g * w - target) / (power * lead + g);
    if (!(next < w)) break;  // at the root but for rounding, in any precision
    w = next;
  }
  return std::copysign(std::pow(w, power), x);
}

double SuperTwisting::implicit_step(double s, double h) noexcept {
  const double b = s + h * w, gain1 = k1(), gain2 = k2();
  double u;
  if (std::abs(b) <= h * h * gain2) {
    w -= b / h;
    u = -s / h;
  } else {
    const double excess = std::abs(b) - h * h * gain2;
    const double q = 2 * excess / (h * gain1 + std::sqrt(h * h * gain1 * gain1 + 4 * excess));
    w -= h * gain2 * sgn(b);
    u = -gain1 * q * sgn(b) + w;
  }
  w = std::clamp(w, -limit, limit);
  return u;
}

}  // namespace whirl::control
