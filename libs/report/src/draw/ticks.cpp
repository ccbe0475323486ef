#include "whirl/report/ticks.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/report/format.hpp"

namespace whirl::report {
namespace {

/// Smallest of 1, 2, 5 times a power of ten that is at least `step`.
double nice_step(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= step * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

}  // namespace

Ticks linear_ticks(double low, double high, int most) {
  Ticks ticks;
  double step = nice_step((high - low) / std::max(1, 2 * most));
  const auto count = [&](double s) { return std::floor(high / s + 1e-9) - std::ceil(low / s - 1e-9) + 1; };
  while (count(step) > most) step = nice_step(step * 1.5);
  // One tick alone does not make a scale: half the step gives three or four (5 becomes 2.5).
  if (count(step) < 2 && most >= 3) step /= 2;
  const double first = std::ceil(low / step - 1e-9);
  const double last = std::floor(high / step + 1e-9);
  const double largest = std::max(std::abs(first), std::abs(last)) * step;
  const int magnitude = largest > 0 ? static_cast<int>(std::floor(std::log10(largest) + 1e-12)) : 0;
  if (magnitude >= 5 || magnitude < -3) ticks.exponent = magnitude;
  const double scale = std::pow(10.0, ticks.exponent);
  const double mantissa_exponent = std::floor(std::log10(step / scale) + 1e-9);
  const bool quarter = std::abs(step / scale / std::pow(10.0, mantissa_exponent) - 2.5) < 1e-6;
  const int decimals = std::max(0, -static_cast<int>(mantissa_exponent) + (quarter ? 1 : 0));
  for (double k = first; k <= last; ++k) {
    ticks.major.push_back(k * step);
    ticks.labels.push_back(format_fixed(k * step / scale, decimals));
  }
  return ticks;
}

Ticks log_ticks(double low, double high, int most) {
  Ticks ticks;
  const int first = static_cast<int>(std::ceil(std::log10(low) - 1e-9));
  const int last = static_cast<int>(std::floor(std::log10(high) + 1e-9));
  const auto inside = [&](double v) { return v >= low * (1 - 1e-9) && v <= high * (1 + 1e-9); };
  const auto text = [](int exponent) {
    return exponent >= -2 && exponent <= 3 ? format_fixed(std::pow(10.0, exponent), std::max(0, -exponent))
                                           : power_of_ten(exponent).substr(std::string("×").size());
  };
  const bool decades_only = last - first >= 2;
  for (int e = first - 1; e <= last; ++e) {
    const double decade = std::pow(10.0, e);
    for (int digit = 1; digit <= 9; ++digit) {
      const double v = digit * decade;
      if (!inside(v)) continue;
      const bool major = digit == 1 || (!decades_only && (digit == 2 || digit == 5));
      if (!major) {
        ticks.minor.push_back(v);
      } else {
        ticks.major.push_back(v);
        ticks.labels.push_back(digit == 1 ? text(e) : format_number(v, 1));
      }
    }
  }
  const auto thin = [&](auto keep) {
    Ticks kept;
    kept.minor = ticks.minor;
    for (std::size_t i = 0; i < ticks.major.size(); ++i) {
      if (keep(ticks.major[i])) {
        kept.major.push_back(ticks.major[i]);
        kept.labels.push_back(ticks.labels[i]);
      } else {
        kept.minor.push_back(ticks.major[i]);
      }
    }
    std::sort(kept.minor.begin(), kept.minor.end());
    ticks = kept;
  };
  if (decades_only && last - first + 1 > most) {
    const int every = (last - first) / std::max(1, most - 1) + 1;
    thin([&](double v) { return (static_cast<int>(std::lround(std::log10(v))) - first) % every == 0; });
  }
  // Inside a fraction of a decade 1-2-5 may give no more than one tick: then steps of equal size do.
  if (ticks.major.size() < 2) ticks = linear_ticks(low, high, most);
  return ticks;
}

Ticks degree_ticks(double low, double high, int most) {
  Ticks ticks;
  const auto count = [&](double s) { return std::floor(high / s + 1e-9) - std::ceil(low / s - 1e-9) + 1; };
  double step = 0;
  for (const double candidate : {5.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0}) {
    step = candidate;
    if (count(step) <= most) break;
  }
  while (count(step) > most) step *= 2;
  for (double k = std::ceil(low / step - 1e-9); k <= std::floor(high / step + 1e-9); ++k) {
    ticks.major.push_back(k * step);
    ticks.labels.push_back(format_fixed(k * step, 0));
  }
  return high - low < 10 ? linear_ticks(low, high, most) : ticks;
}

void widen(double& low, double& high) {
  if (high > low) {
    const double margin = 0.05 * (high - low);
    low -= margin;
    high += margin;
    return;
  }
  const double half = low == 0 ? 1 : 0.1 * std::abs(low);
  low -= half;
  high += half;
}

}  // namespace whirl::report
