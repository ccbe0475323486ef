#include "whirl/core/integrate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

namespace whirl {
namespace {

// x'' = -x, exact solution cos t.
double oscillator_error(int steps) {
  Eigen::Vector2d x(1, 0);
  const double h = 5.0 / steps;
  const auto f = [](double, const Eigen::Vector2d& s) { return Eigen::Vector2d(s[1], -s[0]); };
  for (int i = 0; i < steps; ++i) x = rk4_step(f, i * h, x, h);
  return std::abs(x[0] - std::cos(5.0));
}

TEST(Rk4Convergence, ObservedOrderIsFour) {
  const double order = std::log2(oscillator_error(200) / oscillator_error(400));
  EXPECT_NEAR(order, 4.0, 0.1);
}

}  // namespace
}  // namespace whirl
