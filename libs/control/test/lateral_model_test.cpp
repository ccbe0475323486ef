#include "whirl/control/lateral_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace whirl::control {
namespace {

// The series beside the library's functions in extended precision, over the angles of hours of rotation.
TEST(UnitPhasorReference, IsTrueToRounding) {
  double worst = 0;
  for (const double step : {1e-7, 0.0137, 1.2345, 87.654, 9876.5, 1.3e7}) {
    for (int i = -5000; i <= 5000; ++i) {
      const double angle = step * i;
      const std::complex<double> p = unit_phasor(angle);
      worst = std::fmax(worst, static_cast<double>(std::abs(p.real() - std::cos(static_cast<long double>(angle)))));
      worst = std::fmax(worst, static_cast<double>(std::abs(p.imag() - std::sin(static_cast<long double>(angle)))));
    }
  }
  EXPECT_LT(worst, 2.3e-16);
  EXPECT_TRUE(std::isnan(unit_phasor(std::nan("")).real()));
  EXPECT_TRUE(std::isnan(unit_phasor(HUGE_VAL).imag()));
}

}  // namespace
}  // namespace whirl::control
