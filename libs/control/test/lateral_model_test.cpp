#include "whirl/control/lateral_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/control/estimators/input.hpp"

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

// Every term in complex numbers, as equations have it: stiffness and damping that differ between the axes enter with
// the conjugate of the motion.
std::complex<double> written(const LateralModel& m, std::complex<double> z, std::complex<double> v) {
  return -(m.k1 + m.k2 * std::norm(z)) * z - m.k1_conj * std::conj(z) - m.c * v - m.c_conj * std::conj(v);
}

TEST(MotionPredictionReference, IsTheMidpointStepOfTheEquation) {
  const LateralModel m{8000, 3e9, 7, {-150, 90}, {0.6, -0.4}};
  const std::complex<double> turn = std::polar(1.0, 0.07), first(3, -2), second(-1, 4);
  DiskMotion s{{4e-4, -3e-4}, {0.02, 0.05}, {1.5, -2.5}};
  const double h = 0.6e-3;
  MotionPrediction p(m, s);
  for (const std::complex<double> a : {first, second}) {
    p.step(a, turn, h);
    const std::complex<double> v = s.v + 0.5 * h * (written(m, s.z, s.v) + s.d + a);
    const std::complex<double> rate = written(m, s.z + 0.5 * h * s.v, v) + s.d * turn + a;
    s = {s.z + h * v, s.v + h * rate, s.d * turn * turn};
    EXPECT_LT(std::abs(p.motion().z - s.z), 1e-18);
    EXPECT_LT(std::abs(p.motion().v - s.v), 1e-15);
    EXPECT_LT(std::abs(p.motion().d - s.d), 1e-14);
    EXPECT_LT(std::abs(m.acceleration(s.z, s.v) - written(m, s.z, s.v)), 1e-14);
  }
}

TEST(MotionPredictionUnit, TurnsThatAreKnownChangeNothing) {
  const LateralModel m{8000, 0, 7, {}, {}};
  const DiskMotion s{{4e-4, -3e-4}, {0.02, 0.05}, {1.5, -2.5}};
  for (const double split : {0.0, 0.35}) {
    EstimatorInput in;
    in.split = split, in.omega = 170, in.a_first = {3, -2}, in.a_second = {-1, 4};
    const DiskMotion once = predict_interval(m, s, in, 1e-3);
    in.turns.emplace(in.omega, split, 1e-3);
    const DiskMotion known = predict_interval(m, s, in, 1e-3);
    EXPECT_EQ(once.z, known.z);
    EXPECT_EQ(once.d, known.d);
    EXPECT_LT(std::abs(once.d - s.d * std::polar(1.0, 0.17)), 1e-15);
    EXPECT_LT(std::abs(in.turns->half - std::polar(1.0, 0.085)), 1e-15);
  }
}

}  // namespace
}  // namespace whirl::control
