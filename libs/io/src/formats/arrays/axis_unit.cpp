// Hz or rad/s, by what the numbers of an axis look like.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/arrays/arrays.hpp"

namespace whirl::io {
namespace {

// Size p q of the simplest fraction p/q within a relative tolerance of x > 0, by its continued fraction. A number taken
// at random needs about one over the tolerance.
double size_of_fraction(double x, double tolerance) {
  double p = 1, q = 0, p_before = 0, q_before = 1, rest = x;
  for (int k = 0; k < 64; ++k) {
    const double whole = std::floor(rest);
    const double p_next = whole * p + p_before, q_next = whole * q + q_before;
    p_before = p, q_before = q, p = p_next, q = q_next;
    if (p > 0 && std::abs(p / q - x) <= tolerance * x) break;
    if (!(rest - whole > 0)) break;
    rest = 1 / (rest - whole);
  }
  return std::max(p, 1.0) * q;
}

}  // namespace

AxisUnit unit_by_numbers(const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  if (n < 3 || !values.allFinite()) return AxisUnit::open;
  const double first = values[0], last = values[n - 1], span = last - first;
  if (!(first >= 0) || !(span > 0)) return AxisUnit::open;
  const double step = span / static_cast<double>(n - 1);
  double rounding = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    rounding = std::max(rounding, std::abs(values[i] - first - step * static_cast<double>(i)));
  if (rounding > 0.05 * step) return AxisUnit::open;
  const double tolerance = std::max(4 * rounding / span, 16 * std::numeric_limits<double>::epsilon());
  // How likely a number taken at random is as simple as the step, the last or the first line, in this unit.
  const auto chance = [&](double unit) {
    const double end = std::min(size_of_fraction(step / unit, tolerance), size_of_fraction(last / unit, tolerance));
    if (!(first > 0)) return tolerance * end;
    const double coarse = std::max(tolerance, 4 * rounding / first);
    return std::min(tolerance * end, coarse * size_of_fraction(first / unit, coarse));
  };
  const double hertz = chance(1), radians = chance(2 * std::numbers::pi);
  constexpr double kSure = 1e-3, kRatio = 100;
  if (radians < kSure && hertz > kRatio * radians) return AxisUnit::rad_s;
  if (hertz < kSure && radians > kRatio * hertz) return AxisUnit::hertz;
  return AxisUnit::open;
}

}  // namespace whirl::io
