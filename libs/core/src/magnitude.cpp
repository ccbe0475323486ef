#include "whirl/core/magnitude.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl {
namespace {

constexpr double k95 = 1.959964;
constexpr double kEnd = 0.025;  // chance beyond each end
constexpr double kFar = 5;      // standard deviations: beyond it Rice's law is normal to 1 % of one

/// exp(-x) I0(x) by its series or, from 20 on, its expansion for large x (Abramowitz and Stegun 9.6.12, 9.7.1), to
/// 1e-12: std::cyl_bessel_i takes ten times as long.
double scaled_bessel(double x) {
  double sum = 1, term = 1;
  if (x < 20) {
    const double square = x * x / 4;
    for (int k = 1; term > 1e-12 * sum; ++k) sum += term *= square / (k * k);
    return std::exp(-x) * sum;
  }
  for (int k = 1; k <= 12; ++k) sum += term *= (2 * k - 1) * (2 * k - 1) / (8 * k * x);
  return sum / std::sqrt(2 * std::numbers::pi * x);
}

/// Chance that a vector of size `mean` plus normal errors of unit deviation reads at most `size`.
double chance_below(double size, double mean) {
  constexpr int kSteps = 120;  // even
  const auto density = [&](double x) { return x * std::exp(-0.5 * (x - mean) * (x - mean)) * scaled_bessel(x * mean); };
  const double step = size / kSteps;
  double sum = density(0) + density(size);
  for (int k = 1; k < kSteps; ++k) sum += (k % 2 == 1 ? 4 : 2) * density(k * step);
  return sum * step / 3;
}

/// The size under which the chance to read at most `size` is `chance`; 0 where it is lower under all sizes.
double size_at(double size, double chance) {
  double low = 0, high = size + 2 * k95;
  if (chance_below(size, 0) < chance) return 0;
  for (int k = 0; k < 30; ++k) {
    const double middle = 0.5 * (low + high);
    (chance_below(size, middle) > chance ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

Estimate magnitude_estimate(double value, double sd) {
  if (!(sd > 0) || !std::isfinite(sd) || !(value < kFar * sd)) {
    Estimate e = Estimate::from_sd(value, sd);
    e.low = std::isnan(e.low) ? e.low : std::max(e.low, 0.0);
    return e;
  }
  const double size = value / sd;
  return {value, sd, sd * size_at(size, 1 - kEnd), sd * std::max(size_at(size, kEnd), k95)};
}

}  // namespace whirl
