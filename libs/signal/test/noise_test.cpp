#include "whirl/signal/noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::signal {
namespace {

TEST(NoiseProperty, FindsTheNoiseUnderALargeOscillation) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (const double sd : {1e-5, 1e-3, 0.1}) {
    Eigen::VectorXd v(12000);
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      v[i] = std::sin(2 * M_PI * 20 * 1e-3 * static_cast<double>(i)) + sd * normal(random);
    }
    EXPECT_NEAR(noise_sd(v), sd, 0.035 * sd) << sd;
  }
}

TEST(Noise, IsZeroForPolynomials) {
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(100, 0, 1);
  EXPECT_NEAR(noise_sd(t.cwiseProduct(t)), 0, 1e-14);
}

TEST(Noise, RefusesAShortRecord) { EXPECT_THROW(noise_sd(Eigen::VectorXd::Zero(15)), Error); }

}  // namespace
}  // namespace whirl::signal
