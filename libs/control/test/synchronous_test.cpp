#include <gtest/gtest.h>

#include <numbers>

#include "whirl/control/laws/pd_synchronous.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;
using Method = SynchronousCanceller::Method;

/// Steady synchronous response of the damped rotor: z = G_true (eps + q) e^{i beta}, quasi-static in q.
double residual(Method method, double rate, double phase_error, int turns, double omega = 90) {
  const LateralModel model{5700, 0, 1, {}, {}};
  SynchronousCanceller canceller(method, rate, 0, 40, model, 0, 1e-3, 10);
  const Complex eps{280e-6, 90e-6}, g_true = canceller.response(omega) * unit_phasor(phase_error);
  const double start = std::abs(g_true * eps);
  Complex z;
  for (int k = 0; k < turns * 2 * std::numbers::pi / omega * 1000; ++k) {
    const double beta = omega * 1e-3 * k;
    z = g_true * (eps + canceller.eccentricity()) * unit_phasor(beta);
    canceller.step(z, beta, omega, unbalance_per_metre(beta, omega, 0), true);
  }
  return std::abs(z) / start;
}

TEST(SynchronousReference, AllMethodsFindMinusTheEccentricity) {
  EXPECT_LT(residual(Method::influence, 0.5, 0, 40), 1e-6);
  EXPECT_LT(residual(Method::fxlms, 5, 0, 100), 1e-3);
  EXPECT_LT(residual(Method::notch, 5, 0, 200), 1e-3);
}

TEST(SynchronousReference, InfluenceCoefficientsConvergeInsideTheirBound) {
  // 0 < mu < 2 cos(phase error), here 1 at 60 degrees; more than 90 degrees never converges.
  const double sixty = std::numbers::pi / 3;
  EXPECT_LT(residual(Method::influence, 0.95, sixty, 300), 0.1);
  EXPECT_GT(residual(Method::influence, 1.05, sixty, 300), 10);
  EXPECT_GT(residual(Method::influence, 0.2, 1.6, 300), 1);
}

TEST(SynchronousReference, ContinuousMethodsNeedThePhaseWithin90Degrees) {
  for (Method method : {Method::fxlms, Method::notch}) {
    EXPECT_LT(residual(method, 5, 1.3, 200), 0.5);
    EXPECT_GT(residual(method, 5, 1.8, 200), 1.5);
  }
}

TEST(SynchronousUnit, FreezesWhenSlowOrBlind) {
  SynchronousCanceller c(Method::fxlms, 5, 0, 40, {5700, 0, 1, {}, {}}, 0, 1e-3, 10);
  for (int k = 0; k < 100; ++k) {
    c.step(1e-4, 0.005 * k, 5, 25, true);
    c.step(1e-4, 0.1 * k, 100, 1e4, false);
  }
  EXPECT_EQ(c.eccentricity(), Complex{});
}

}  // namespace
}  // namespace whirl::control
