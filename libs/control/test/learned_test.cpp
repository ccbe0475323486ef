#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "whirl/control/lateral_model.hpp"
#include "whirl/control/laws.hpp"
#include "whirl/control/method.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;

/// The law with every weight drawn at random.
LearnedPolicy drawn(std::mt19937_64& random) {
  std::uniform_real_distribution<double> any(-3, 3);
  ControllerDesign d = testing::design_of("learned", "lpf");
  for (const std::string& w : law_entry("learned").weights) d.parameters[w] = any(random);
  return std::get<LearnedPolicy>(law_entry("learned").make(d, resolve_parameters(d)));
}

TEST(LearnedPolicyProperty, BothDirectionsOfAnAxisAreAlikeAndRestStaysAtRest) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 100; ++i) {
    LearnedPolicy p = drawn(random);
    const AxisInput in{1e-4 * normal(random), 1e-2 * normal(random), 0, normal(random)};
    EXPECT_DOUBLE_EQ(p.x.step(in).a, -p.x.step({-in.x, -in.v, 0, -in.d}).a);
    EXPECT_EQ(p.x.step({}).a, 0);
  }
}

// A mirror turns the rotor the other way round; the force is the mirrored one.
TEST(LearnedPolicyProperty, ARotorThatTurnsBackwardsIsTheMirroredOne) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 20; ++i) {
    LearnedSynchronous forward = drawn(random).synchronous, backward = forward;
    for (int k = 0; k < 50; ++k) {
      const double beta = 0.12 * k;
      const Complex z = std::polar(1e-4, beta + 0.01 * k), f = unbalance_per_metre(beta, 120, 2);
      const Complex a = forward.step(z, beta, 120, f, true);
      const Complex b = backward.step(std::conj(z), -beta, -120, std::conj(f), true);
      EXPECT_NEAR(std::abs(a - std::conj(b)), 0, 1e-14 * std::abs(a));
    }
  }
}

TEST(LearnedPolicyProperty, WithoutWeightsItIsPd) {
  ControllerDesign d = testing::design_of("learned", "lpf");
  for (const std::string& w : law_entry("learned").weights) d.parameters[w] = 0;
  LearnedPolicy p = std::get<LearnedPolicy>(law_entry("learned").make(d, resolve_parameters(d)));
  Pd pd{p.x.kp, p.x.kd};
  const AxisInput in{3e-5, -2e-3, 0.4, 0.4};
  EXPECT_EQ(p.x.step(in).a, pd.step(in).a);
  EXPECT_EQ(p.synchronous.step(1e-4, 0.3, 100, 1e4, true), Complex{});
}

// Steady whirl z = G (eps + q) e^{i beta} of a rotor at 12 Hz with 0.4 of critical damping, quasi-static in q: the
// weights of the catalogue lead to q = -eps below, at and above its critical speed.
TEST(LearnedPolicyReference, TheWeightsOfTheCatalogueFindMinusTheEccentricity) {
  ControllerDesign d = testing::design_of("learned", "lpf");
  const Parameters v = resolve_parameters(d);
  const double natural = v.at("speed_scale");
  for (const double ratio : {0.4, 0.8, 1.0, 1.3, 2.0, 3.0}) {
    LearnedSynchronous s = std::get<LearnedPolicy>(law_entry("learned").make(d, v)).synchronous;
    const double w = ratio * natural;
    const Complex g = w * w / Complex(natural * natural - w * w, 2 * 0.4 * natural * w), eps(280e-6, 90e-6);
    Complex q;
    for (int k = 0; k < 20000; ++k) {
      const double beta = 1e-3 * w * k;
      q = s.step(g * (eps + q) * unit_phasor(beta), beta, w, 1, true);
    }
    EXPECT_LT(std::abs(eps + q), 1e-3 * std::abs(eps)) << ratio;
  }
}

}  // namespace
}  // namespace whirl::control
