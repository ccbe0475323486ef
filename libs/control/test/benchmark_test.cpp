// The mechanism benchmark: one rotor axis, ideal states, laws at 1 kHz on a plant integrated at 100 kHz.
#include <gtest/gtest.h>

#include <numbers>

#include "whirl/control/laws.hpp"

namespace whirl::control {
namespace {

struct Outcome {
  double residual = 0;   ///< rms of x after the first second, m
  double variation = 0;  ///< of a, m/s^2 per s
};

/// f0 = 10 Hz, zeta = 1 %, stiffness known to 20 %, D = 0.42 sin(2 pi 10 t) + 0.18 sin(2 pi 27 t) m/s^2.
template <class Law>
Outcome run(Law law, bool control = true) {
  const double w = 2 * std::numbers::pi * 10, c = 2 * 0.01 * w, h = 1e-3, dt = 1e-5;
  double x = 1e-3, v = 0, last = 0;
  Outcome out;
  long samples = 0;
  for (int k = 0; k < 4000; ++k) {
    const double f = -0.8 * w * w * x - c * v;
    const double a = control ? law.step({x, v, f, 0}).a : 0;
    if (k > 1000) out.variation += std::abs(a - last);
    last = a;
    for (int i = 0; i < 100; ++i) {
      const double t = h * k + dt * i;
      const double d = 0.42 * std::sin(w * t) + 0.18 * std::sin(2.7 * w * t);
      v += dt * (-w * w * x - c * v + a + d);
      x += dt * v;
      if (k > 1000) out.residual += x * x, ++samples;
    }
  }
  out.residual = std::sqrt(out.residual / static_cast<double>(samples));
  out.variation /= 3;
  return out;
}

TerminalSmc terminal(double epsilon, double delta) {
  return {60, 0.9, epsilon, {0.6, delta, 1e-3, Regularisation::clamp}};
}

// Table of the notes, residual in um rms and variation in k mm/s^2 per s; one run and one tuning per law, so
// the bounds are wide: they hold the ranking of mechanisms, not the digits.
TEST(LawBenchmarkReference, OpenLoopLevel) { EXPECT_NEAR(run(Pd{}, false).residual, 2676e-6, 0.2 * 2676e-6); }

TEST(LawBenchmarkReference, TerminalLawWithLayer) {
  const Outcome thin = run(terminal(5e-3, 0.1e-6)), clamped = run(terminal(5e-3, 7.9e-6)),
                wide = run(terminal(20e-3, 7.9e-6));
  EXPECT_NEAR(thin.residual, 3.1e-6, 1e-6);
  EXPECT_NEAR(thin.variation, 32, 12);
  EXPECT_NEAR(clamped.residual, 3.6e-6, 1e-6);
  EXPECT_NEAR(clamped.variation, 28, 10);
  EXPECT_NEAR(wide.residual, 15e-6, 4e-6);
  EXPECT_NEAR(wide.variation, 24, 8);
}

TEST(LawBenchmarkReference, SwitchingChattersAndTheClampHelps) {
  const Outcome printed = run(terminal(1e-9, 0.1e-6)), clamped = run(terminal(1e-9, 7.9e-6));
  EXPECT_NEAR(printed.variation, 2584, 900);
  EXPECT_NEAR(clamped.variation, 1217, 450);
  EXPECT_GT(clamped.variation, 20 * run(terminal(5e-3, 7.9e-6)).variation);
}

TEST(LawBenchmarkReference, ImplicitTerminalLawNeedsNoClamp) {
  const Outcome one = run(ImplicitTerminalSmc{60, 0.9, 1e-3, 0.6, 1e-3, 1e-3});
  const Outcome three = run(ImplicitTerminalSmc{60, 0.9, 3e-3, 0.6, 1e-3, 1e-3});
  EXPECT_NEAR(one.residual, 0.52e-6, 0.3e-6);
  EXPECT_NEAR(one.variation, 24, 8);
  EXPECT_NEAR(three.residual, 2.3e-6, 0.8e-6);
  EXPECT_NEAR(three.variation, 27, 9);
  // 108 times less variation than the switching law, at a lower residual.
  const Outcome switching = run(terminal(1e-9, 0.1e-6));
  EXPECT_LT(one.variation, switching.variation / 50);
  EXPECT_LT(one.residual, switching.residual);
}

TEST(LawBenchmarkReference, SuperTwistingOnTheLinearSurface) {
  // The implicit form leaves s = h D (one sample late), here at most h 0.6 / C = 10 um of displacement.
  SuperTwistingSmc law{60, {40, 10, 0}, 1e-3, false};
  const Outcome explicit_form = run(law);
  law.implicit = true;
  const Outcome implicit = run(law);
  EXPECT_LT(explicit_form.residual, 0.9e-6);
  EXPECT_LT(implicit.residual, 1e-3 * 0.6 / 60 / std::numbers::sqrt2);
  EXPECT_LT(implicit.variation, explicit_form.variation);
}

/// Displacement after 0.5 s of the same axis under a law sampled with h, plant at 8 us.
template <class Law>
double sampled_end(Law law, int steps_per_sample) {
  const double w = 2 * std::numbers::pi * 10, c = 2 * 0.01 * w, dt = 8e-6;
  double x = 1e-3, v = 0, a = 0;
  for (int i = 0; i < 62500; ++i) {
    const double t = dt * i;
    if (i % steps_per_sample == 0) a = law.step({x, v, -0.8 * w * w * x - c * v, 0}).a;
    const auto rate = [&](double s, double px, double pv) {
      return -w * w * px - c * pv + a + 0.42 * std::sin(w * s) + 0.18 * std::sin(2.7 * w * s);
    };
    const double a1 = rate(t, x, v), xm = x + 0.5 * dt * v, vm = v + 0.5 * dt * a1, a2 = rate(t + 0.5 * dt, xm, vm);
    x += dt * vm;
    v += dt * a2;
  }
  return x;
}

// The hold is late by half a sample on average: the sampled loop tends to the continuous one with the first order of h.
TEST(SampledLoopConvergence, FirstOrderInTheSampleTime) {
  const auto order = [](const auto& law) {
    const double limit = sampled_end(law, 1);
    const double coarse = std::abs(sampled_end(law, 25) - limit), fine = std::abs(sampled_end(law, 5) - limit);
    return std::log(coarse / fine) / std::log(24.0 / 4.0);
  };
  EXPECT_NEAR(order(terminal(20e-3, 50e-6)), 1, 0.15);
  EXPECT_NEAR(order(LinearSmc{60, 0.9, 20e-3}), 1, 0.15);
  EXPECT_NEAR(order(Pd{0, 60}), 1, 0.15);
}

}  // namespace
}  // namespace whirl::control
