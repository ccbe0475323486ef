#pragma once
#include <cmath>
#include <numbers>
#include <random>

namespace whirl::tuning {

// Random numbers that are the same with every standard library.

/// In [0, 1).
inline double uniform(std::mt19937_64& engine) { return static_cast<double>(engine() >> 11) * 0x1p-53; }

/// Of mean 0 and standard deviation 1, by Box and Muller.
inline double normal(std::mt19937_64& engine) {
  const double radius = std::sqrt(-2 * std::log(1 - uniform(engine)));
  return radius * std::cos(2 * std::numbers::pi * uniform(engine));
}

}  // namespace whirl::tuning
