#pragma once
#include <cmath>
#include <complex>

#include "whirl/core/control_types.hpp"

namespace whirl::control {

/// Plausibility gate for displacement readings: a lost, non-finite, out-of-range or jumping sample is
/// replaced by the last good one and counted. The allowed jump grows with every held sample, so that the gate
/// re-acquires by itself.
struct SampleGate {
  double range = 12.4e-3;     ///< |x|, |y| at or above this is a saturated sensor, m
  double jump = 2e-3;         ///< largest plausible change in one sample, m
  std::complex<double> good;  ///< last good reading
  long held = 0;              ///< samples held in a row
  long held_total = 0;

  /// True: the reading is used (it is in `good`); false: `good` is the held one.
  bool accept(const Measurement& m) noexcept {
    const std::complex<double> z{m.x, m.y};
    const double change = std::sqrt(std::norm(z - good));
    // Written so that NaN fails.
    const bool ok = m.valid && std::abs(m.x) < range && std::abs(m.y) < range &&
                    (first_ || change <= jump * static_cast<double>(1 + held));
    if (ok) {
      good = z;
      held = 0;
      first_ = false;
    } else {
      ++held;
      ++held_total;
    }
    return ok;
  }
  void reset() noexcept {
    good = {};
    held = held_total = 0;
    first_ = true;
  }

 private:
  bool first_ = true;
};

}  // namespace whirl::control
