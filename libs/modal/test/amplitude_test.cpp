// Modes of machines whose stiffness depends on the amplitude: what the hammer shows is not of small motion.
#include <gtest/gtest.h>

#include "synthetic.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/testing/nonlinear_blows.hpp"

namespace {

using whirl::testing::make_nonlinear_blows;
using whirl::testing::score;

struct Sum {
  int modes = 0, extra = 0, frequency = 0, damping = 0;
  void add(const whirl::testing::ModeScore& s) {
    modes += s.frequency;
    extra += s.extra;
    frequency += s.covered_frequency;
    damping += s.covered_damping;
  }
};

TEST(ModesProperty, IntervalsOfANonlinearRotorCoverItsModesOfSmallMotion) {
  Sum sum;
  for (unsigned seed = 701; seed <= 708; ++seed) {
    const auto data = make_nonlinear_blows({.hardening = seed % 2 == 0 ? 0.001 : 0.0025, .seed = seed});
    sum.add(score(data.poles, whirl::modal::fit_modes(whirl::modal::estimate_frf(data.blows))));
  }
  EXPECT_EQ(sum.modes, 32);
  EXPECT_EQ(sum.extra, 0);
  EXPECT_GE(sum.frequency, 28);
  EXPECT_GE(sum.damping, 28);
}

TEST(ModesProperty, LinearRotorsShowNoDependenceOnTheAmplitude) {
  for (unsigned seed = 721; seed <= 726; ++seed) {
    const auto data = make_nonlinear_blows({.hardening = 0, .seed = seed});
    const auto model = whirl::modal::fit_modes(whirl::modal::estimate_frf(data.blows));
    EXPECT_TRUE(model.amplitude.empty()) << seed;
    EXPECT_EQ(score(data.poles, model).extra, 0) << seed;
  }
}

// The shift after the blow is known from the law: hardening raises the frequency, softening lowers it.
TEST(ModesProperty, ShiftOfTheFrequencyAfterABlowIsThatOfTheStiffness) {
  for (const double hardening : {0.002, -0.002}) {
    const auto data = make_nonlinear_blows({.hardening = hardening, .split = false, .spread = 0, .seed = 731});
    const auto model = whirl::modal::fit_modes(whirl::modal::estimate_frf(data.blows));
    ASSERT_FALSE(model.modes.empty());
    const whirl::Mode& rotor = model.modes.front();
    EXPECT_NEAR(rotor.amplitude_offset.imag() / rotor.pole.imag(), hardening, 0.2 * std::abs(hardening));
  }
}

}  // namespace
