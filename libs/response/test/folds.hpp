#pragma once
#include <algorithm>
#include <vector>

#include "whirl/response/synchronous.hpp"

/// Folds and peak of the closed form, found by how many answers there are.
namespace whirl::response {

/// Speeds in the range at which one answer becomes three or three become one, ascending, rad/s.
inline std::vector<double> synchronous_folds(const RotorModel& rotor, double low, double high) {
  constexpr int kSteps = 4000;
  const auto answers = [&](double omega) { return synchronous_answers(rotor, omega).size(); };
  std::vector<double> folds;
  for (int k = 0; k < kSteps; ++k) {
    double a = low + (high - low) * k / kSteps, b = low + (high - low) * (k + 1) / kSteps;
    const std::size_t before = answers(a);
    if (answers(b) == before) continue;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (a + b);
      (answers(middle) == before ? a : b) = middle;
    }
    folds.push_back(0.5 * (a + b));
  }
  return folds;
}

/// Largest radius on any branch: a grid over the speeds, then a grid around its best, four times.
inline SynchronousPoint synchronous_peak(const RotorModel& rotor, double low, double high) {
  SynchronousPoint best;
  for (int round = 0; round < 4; ++round) {
    constexpr int kSteps = 2000;
    const double step = (high - low) / kSteps;
    for (int k = 0; k <= kSteps; ++k) {
      const std::vector<SynchronousPoint> all = synchronous_answers(rotor, low + step * k);
      if (!all.empty() && all.back().radius > best.radius) best = all.back();
    }
    low = std::max(low, best.omega - step);
    high = std::min(high, best.omega + step);
  }
  return best;
}

}  // namespace whirl::response
