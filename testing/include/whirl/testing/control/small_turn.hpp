#pragma once
#include <complex>

namespace whirl::testing {

/// e^{i d} of a turn within one integration step, |d| < 0.05 rad, to rounding: a tenth of the time of sin and cos.
inline std::complex<double> small_turn(double d) {
  const double q = d * d;
  return {1 - q / 2 * (1 - q / 12 * (1 - q / 30)), d * (1 - q / 6 * (1 - q / 20 * (1 - q / 42)))};
}

}  // namespace whirl::testing
