#include "whirl/diagnosis/standards.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {

using Eigen::Index;

std::optional<Amplification> amplification(const signal::SynchronousCurve& curve, int turns) {
  const Eigen::VectorXd a = curve.vector.cwiseAbs();
  const Index n = a.size();
  if (n < 3 || curve.speed.size() != n) return std::nullopt;
  Index top = 0;
  const double largest = a.maxCoeff(&top), level = largest / std::numbers::sqrt2;
  const auto crossing = [&](Index step) -> std::optional<double> {
    for (Index i = top; i + step >= 0 && i + step < n; i += step) {
      if (a[i + step] > level) continue;
      const double part = (a[i] - level) / (a[i] - a[i + step]);
      return curve.speed[i] + part * (curve.speed[i + step] - curve.speed[i]);
    }
    return std::nullopt;
  };
  const auto before = crossing(-1), after = crossing(1);
  if (!before || !after || *before == *after) return std::nullopt;
  Amplification out;
  out.critical = curve.speed[top];
  out.amplitude = largest;
  out.low = std::min(*before, *after);
  out.high = std::max(*before, *after);
  out.factor = out.critical / (out.high - out.low);
  // Between two revolutions Omega^2 changes by 2 alpha times the angle turned.
  const Index from = std::max<Index>(0, top - 5), to = std::min(n - 1, top + 5);
  out.sweep_rate = (curve.speed[to] * curve.speed[to] - curve.speed[from] * curve.speed[from]) /
                   (2 * kTwoPi * turns * static_cast<double>(to - from));
  out.sweep = std::abs(out.sweep_rate) / (out.critical * out.critical);
  return out;
}

double required_margin(double factor, bool critical_below) {
  if (factor < 2.5) return 0;
  const double margin = 17 * (1 - 1 / (factor - 1.5));
  return 0.01 * (critical_below ? std::min(16.0, margin) : std::min(26.0, 10 + margin));
}

double shaft_vibration_limit(char zone, double speed) {
  if (!(speed > 0)) throw Error::in_field("speed", std::to_string(speed), "positive");
  const double factor = zone == 'A' ? 4800 : zone == 'B' ? 9000 : 13200;
  return 1e-6 * factor / std::sqrt(speed * 60 / kTwoPi);
}

char shaft_vibration_zone(double peak_to_peak, double speed) {
  for (const char zone : {'A', 'B', 'C'}) {
    if (peak_to_peak <= shaft_vibration_limit(zone, speed)) return zone;
  }
  return 'D';
}

double balance_grade(double eccentricity, double speed) { return eccentricity * speed; }

double balance_grade_class(double grade) {
  for (const double g : {0.4, 1.0, 2.5, 6.3, 16.0, 40.0, 100.0, 250.0, 630.0, 1600.0, 4000.0}) {
    if (1e3 * grade <= g) return g;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace whirl::diagnosis
