#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>
#include <random>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/laws/lqi.hpp"
#include "whirl/control/laws/lqi_gains.hpp"
#include "whirl/control/laws/lqr.hpp"
#include "whirl/control/laws/mpc.hpp"
#include "whirl/control/laws/pd_fxlms_xy.hpp"
#include "whirl/control/laws/pd_scheduled.hpp"
#include "whirl/control/laws/pd_synchronous.hpp"
#include "whirl/control/method.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;
constexpr double kTurnStep = 1e-3;

ControllerDesign design(const std::string& law) { return testing::design_of(law, "lpf"); }

template <class Law>
Law made(const ControllerDesign& d) {
  return std::get<Law>(law_entry(d.law).make(d, resolve_parameters(d)));
}

TEST(TurningIntegralReference, WithoutItsWeightTheGainsAreThoseOfTheRegulator) {
  const LqrGains plain = lqr_gains(5700, 1, kTurnStep, 1e-3, 0.05, 3);
  for (const double omega : {0.0, 40.0, 75.0, 160.0}) {
    const LqiGains g = lqi_gains(5700, 1, omega, kTurnStep, {1e-3, 0.05, 1e6, 3});
    EXPECT_NEAR(std::abs(g.z - plain.kp), 0, 1e-6 * std::abs(plain.kp)) << omega;
    EXPECT_NEAR(std::abs(g.v - plain.kd), 0, 1e-6 * plain.kd) << omega;
  }
}

TEST(TurningIntegralReference, TheRiccatiEquationIsSolvedAndTheLoopStable) {
  for (const double k1 : {5700.0, -900.0}) {
    for (double omega = 0; omega < 400; omega += 37) {
      const LqiGains g = lqi_gains(k1, 1, omega, kTurnStep, {1e-4, 0.02, 1e-5, 3});
      EXPECT_LT(g.residual, 1e-10) << omega;
      EXPECT_LT(g.spectral_radius, 1) << omega;
    }
  }
}

/// Largest synchronous part of the last tenth of a run at a held speed, m, of a rotor that is not the model: stiffer,
/// its axes unlike, pushed by an unbalance and by a force that turns with it for another reason.
double held(const IntegralRegulator& law, double omega, double stiffer, double seconds) {
  IntegralRegulator c = law;
  const SampledAxis x = sample_axis(5700 * stiffer, 1, kTurnStep);
  double q[4] = {};  // x, v of both axes
  double largest = 0;
  const long n = std::lround(seconds / kTurnStep);
  for (long k = 0; k < n; ++k) {
    const double beta = omega * kTurnStep * static_cast<double>(k);
    const Complex z{q[0], q[2]}, v{q[1], q[3]};
    const Complex forcing = unbalance_per_metre(beta, omega, 0);
    if (10 * k > 9 * n) largest = std::max(largest, std::abs(z));
    const Complex a = c.synchronous.step(z, beta, omega, forcing, true) + c.linear.step(z, v, omega) +
                      product({280e-6, 90e-6}, forcing) + product({0.4, -0.2}, unit_phasor(beta));
    const double x0 = q[0], y0 = q[2];
    q[0] = x.a00 * x0 + x.a01 * q[1] + x.b0 * a.real(), q[1] = x.a10 * x0 + x.a11 * q[1] + x.b1 * a.real();
    q[2] = x.a00 * y0 + x.a01 * q[3] + x.b0 * a.imag(), q[3] = x.a10 * y0 + x.a11 * q[3] + x.b1 * a.imag();
  }
  return largest;
}

TEST(TurningIntegralReference, AtAHeldSpeedTheSynchronousMotionGoesToZero) {
  ControllerDesign d = design("lqi");
  for (const double omega : {30.0, 75.0, 140.0, 260.0, -75.0}) {
    const auto law = made<IntegralRegulator>(d);
    EXPECT_LT(held(law, omega, 1, 60), 1e-12) << omega;
    EXPECT_LT(held(law, omega, 1.2, 60), 1e-12) << omega;  // a model that is wrong
    d.parameters["integral_scale"] = 1e3;                  // no integral: what a regulator leaves
    EXPECT_GT(held(made<IntegralRegulator>(d), omega, 1, 30), 1e-5) << omega;
    d.parameters.erase("integral_scale");
  }
}

TEST(SpeedScheduleReference, GainsEqualTheUnscheduledAtTheNodesAndLieBetweenThem) {
  ControllerDesign d = design("pd_scheduled");
  const double speeds[] = {30, 70, 90, 150}, kp[] = {4000, -500, 300, 7000}, kd[] = {20, 200, 80, 10};
  for (int k = 0; k < 4; ++k) {
    const std::string node = std::to_string(k + 1);
    d.parameters["speed_" + node] = speeds[k], d.parameters["kp_" + node] = kp[k], d.parameters["kd_" + node] = kd[k];
  }
  auto law = made<LateralLaw<ScheduledPd>>(d).x;
  const AxisInput at{1e-4, 0.01, 3, 0.5};
  for (int k = 0; k < 4; ++k) {
    for (const double side : {1.0, -1.0}) {
      AxisInput in = at;
      in.omega = side * speeds[k];
      EXPECT_EQ(law.step(in).a, (Pd{kp[k], kd[k]}.step(in).a)) << k;
    }
  }
  AxisInput in = at;
  in.omega = 80;
  EXPECT_NEAR(law.step(in).a, (Pd{-100, 140}.step(in).a), 1e-12);
  in.omega = 0;
  EXPECT_EQ(law.step(in).a, (Pd{kp[0], kd[0]}.step(in).a));
  in.omega = 1e4;
  EXPECT_EQ(law.step(in).a, (Pd{kp[3], kd[3]}.step(in).a));
}

TEST(SpeedScheduleReference, TheTurningRegulatorIsThatOfEachNode) {
  ControllerDesign d = design("lqi");
  d.parameters["speed_top"] = 220;
  TurningFeedback law = made<IntegralRegulator>(d).linear;
  const Complex z{1e-4, -3e-5}, v{0.01, 0.02};
  for (int k = 0; k < 12; ++k) {
    const double omega = 20.0 * k;
    const LqiGains g = lqi_gains(5700, 1, omega, d.sample_time, {1e-3, 0.05, 1e-4, 3});
    EXPECT_NEAR(std::abs(law.step(z, v, omega) + g.z * z + g.v * v), 0, 1e-12 * std::abs(g.z * z + g.v * v));
    EXPECT_NEAR(std::abs(law.step(std::conj(z), std::conj(v), -omega) - std::conj(law.step(z, v, omega))), 0, 1e-15);
  }
}

TEST(SpeedScheduleUnit, NodesThatDoNotRiseAreRefusedByName) {
  ControllerDesign d = design("pd_scheduled");
  d.parameters["speed_3"] = d.parameters["speed_2"] = 50;
  try {
    resolve_parameters(d);
    FAIL();
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("speed_3"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("above speed_2"), std::string::npos) << e.what();
  }
}

const LateralModel kUnlike{5700, 0, 3, {900, 400}, {0.5, -0.3}};

TEST(MultiChannelReference, ResponseIsTheInverseOfTheDynamicStiffness) {
  const MultiChannelLms law(3, 200, 40, kUnlike, 2e-3, kTurnStep, 10);
  for (const double omega : {20.0, 75.0, 130.0, -60.0}) {
    Eigen::Matrix2cd k;
    const Complex i(0, omega), pd = (200.0 + 40.0 * i) * std::exp(-i * 2e-3);
    k << 6600 - omega * omega + 3.5 * i + pd, 400.0 - 0.3 * i, 400.0 - 0.3 * i, 4800 - omega * omega + 2.5 * i + pd;
    const Eigen::Matrix2cd g = omega * omega * k.inverse();
    const MultiChannelLms::Response r = law.response(omega);
    EXPECT_NEAR(std::abs(r.xx - g(0, 0)) + std::abs(r.xy - g(0, 1)) + std::abs(r.yy - g(1, 1)), 0, 1e-12);
    EXPECT_NEAR(r.largest, (g.adjoint() * g).eval().operatorNorm(), 1e-10 * r.largest);
  }
}

/// |z| left of the quasi-static response of unlike axes, y with an actuator 20 % weaker, by its start.
template <class Law>
double left(Law law, double omega, double seconds) {
  const MultiChannelLms truth(1, 0, 40, kUnlike, 0, kTurnStep, 10);
  const MultiChannelLms::Response g = truth.response(omega);
  const Complex eps{280e-6, 90e-6};
  const double start = std::abs(g.xx * eps) + std::abs(g.yy * eps);
  double largest = 0;
  Complex wx = 0, wy = 0;
  const long n = std::lround(seconds / kTurnStep);
  for (long k = 0; k < n; ++k) {
    const double beta = omega * kTurnStep * static_cast<double>(k);
    const Complex turn = unit_phasor(beta), ux = eps + wx, uy = Complex(0, -1) * eps + 0.8 * wy;
    const Complex x = g.xx * ux + g.xy * uy, y = g.xy * ux + g.yy * uy;
    const Complex z{(x * turn).real(), (y * turn).real()};
    if (10 * k > 9 * n) largest = std::max(largest, std::abs(z));
    law.step(z, beta, omega, unbalance_per_metre(beta, omega, 0), true);
    if constexpr (requires { law.weights(); }) {
      wx = law.weights()[0], wy = law.weights()[1];
    } else {
      wx = law.eccentricity(), wy = Complex(0, -1) * wx;
    }
  }
  return largest / start;
}

TEST(MultiChannelReference, UnlikeActuatorsAreAnsweredWhereOneWeightLeavesAWhirl) {
  for (const double omega : {40.0, 70.0, 120.0}) {
    EXPECT_LT(left(MultiChannelLms(3, 0, 40, kUnlike, 0, kTurnStep, 10), omega, 40), 1e-4) << omega;
  }
  const SynchronousCanceller one(SynchronousCanceller::Method::fxlms, 3, 0, 40, kUnlike, 0, kTurnStep, 10);
  EXPECT_GT(left(one, 70, 40), 0.01);
}

// Like axes: G^H G = lambda 1, so the motion dies away with the rate mu.
TEST(MultiChannelReference, MuIsTheRateOfLikeAxes) {
  const LateralModel like{5700, 0, 3, {}, {}};
  for (const double omega : {25.0, 75.0, 200.0}) {
    MultiChannelLms law(2, 0, 40, like, 0, kTurnStep, 10);
    const Complex eps{280e-6, 90e-6}, g = law.response(omega).xx;
    constexpr long kTicks = 1000;
    for (long k = 0; k < kTicks; ++k) {
      const double beta = omega * kTurnStep * static_cast<double>(k);
      const Complex w = 0.5 * (law.weights()[0] + Complex(0, 1) * law.weights()[1]);
      law.step(g * (eps + w) * unit_phasor(beta), beta, omega, unbalance_per_metre(beta, omega, 0), true);
    }
    const Complex w = 0.5 * (law.weights()[0] + Complex(0, 1) * law.weights()[1]);
    EXPECT_NEAR(std::abs(eps + w) / std::abs(eps), std::exp(-2.0), 0.05 * std::exp(-2.0)) << omega;
  }
}

TEST(MultiChannelUnit, FreezesWhenSlowOrBlind) {
  MultiChannelLms c(5, 0, 40, kUnlike, 0, kTurnStep, 10);
  for (int k = 0; k < 100; ++k) {
    c.step(1e-4, 0.005 * k, 5, 25, true);
    c.step(1e-4, 0.1 * k, 100, 1e4, false);
  }
  EXPECT_EQ(c.weights()[0], Complex{});
  EXPECT_EQ(c.weights()[1], Complex{});
}

}  // namespace
}  // namespace whirl::control
