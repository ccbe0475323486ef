#include "whirl/control/laws.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "whirl/control/times.hpp"

namespace whirl::control {
namespace {

/// x' = v, v' = a + D with the law evaluated at every step of a fine explicit integration (ideal, continuous
/// control).
struct Motion {
  double reach = -1, settle = -1, s_end = 0, x_end = 0;
};
template <class Law>
Motion simulate(Law law, double x, double v, double disturbance, double duration, double dt, double tolerance) {
  Motion run;
  double s_first = 0;
  const long n = std::lround(duration / dt);
  for (long i = 0; i < n; ++i) {
    const AxisOutput out = law.step({x, v, 0, 0});
    if (i == 0) s_first = out.s;
    if (run.reach < 0 && (out.s * s_first <= 0 || std::abs(out.s) < 3e-5)) run.reach = static_cast<double>(i) * dt;
    if (std::abs(x) > tolerance) run.settle = static_cast<double>(i + 1) * dt;
    v += dt * (out.a + disturbance);
    x += dt * v;
    run.s_end = std::max(i > n - 1000 ? std::abs(out.s) : 0.0, i > n - 1000 ? run.s_end : 0.0);
    run.x_end = std::max(i > n - 1000 ? std::abs(x) : 0.0, i > n - 1000 ? run.x_end : 0.0);
  }
  return run;
}

TerminalSmc switching_law(double rho) {
  TerminalSmc law;
  law.surface_gain = 20;
  law.switching_gain = rho;
  law.boundary_layer = 1e-5;  // practically sgn at the step of the simulation
  law.power = {0.6, 1e-9, 1e-3, Regularisation::clamp};
  return law;
}

TEST(SlidingTimeReference, TerminalSurfaceSettlesAtTheFormula) {
  // On the surface from the start: s(0) = 0, so the whole time is the sliding time (paper eq. 30).
  const TerminalSmc law = switching_law(20);
  const double x0 = 0.41e-3, v0 = -law.surface_gain * law.power.value(x0);
  const Motion run = simulate(law, x0, v0, 0, 0.2, 1e-7, 1e-7);
  const double expected = slide_time_terminal(x0, 20, 0.6);
  EXPECT_NEAR(run.settle, expected, 0.04 * expected);
}

TEST(SlidingTimeReference, PublishedExampleOfTheReachTime) {
  // Terminal sliding from 0.41 mm with r = 7/9: 0.527, 0.308 and 0.062 s for C = 7, 12 and 60 1/s.
  const double r = 7.0 / 9.0;
  EXPECT_NEAR(slide_time_terminal(0.41e-3, 7, r), 0.527, 5e-4);
  EXPECT_NEAR(slide_time_terminal(0.41e-3, 12, r), 0.308, 5e-4);
  EXPECT_NEAR(slide_time_terminal(0.41e-3, 60, r), 0.062, 5e-4);
}

TEST(SlidingTimeReference, FastTerminalSurfaceSettlesAtTheFormula) {
  FastTerminalSmc law;
  law.linear_gain = 15, law.surface_gain = 20, law.switching_gain = 20, law.boundary_layer = 1e-5;
  law.power = {0.6, 1e-9, 1e-3, Regularisation::clamp};
  const double x0 = 1e-3, v0 = -law.linear_gain * x0 - law.surface_gain * law.power.value(x0);
  const Motion run = simulate(law, x0, v0, 0, 0.2, 1e-7, 1e-7);
  const double expected = slide_time_fast_terminal(x0, 15, 20, 0.6);
  EXPECT_NEAR(run.settle, expected, 0.04 * expected);
  EXPECT_LT(expected, slide_time_terminal(x0, 20, 0.6));
}

TEST(SlidingTimeReference, NonsingularSurfaceHasTheSameSlidingTime) {
  NonsingularTerminalSmc law;
  law.surface_gain = 20, law.switching_gain = 20, law.boundary_layer = 1e-6, law.exponent = 0.6;
  const double x0 = 1e-3, unit = 20e-3;
  const double v0 = -unit * std::pow(1.0, 0.6);
  ASSERT_NEAR(law.step({x0, v0, 0, 0}).s, 0, 1e-12);
  const Motion run = simulate(law, x0, v0, 0, 0.2, 1e-7, 1e-6);
  EXPECT_NEAR(run.settle, slide_time_terminal(x0, 20, 0.6), 0.1 * run.settle);
}

TEST(SlidingTimeReference, ReachTimeIsABoundWithDisturbance) {
  const TerminalSmc law = switching_law(3);
  const double x0 = 1e-3, v0 = 0.2, disturbance = 1.5;
  const double s0 = v0 + 20 * law.power.value(x0);
  const Motion run = simulate(law, x0, v0, disturbance, 0.4, 1e-6, 1e-7);
  ASSERT_GT(run.reach, 0);
  EXPECT_LE(run.reach, reach_time(s0, 3, disturbance) * 1.001);
  EXPECT_GE(run.reach, reach_time(s0, 3, -disturbance) * 0.999);  // fastest possible
  EXPECT_TRUE(std::isinf(reach_time(s0, 3, 3)));
}

TEST(SlidingTimeReference, LayerResidualBoundsHold) {
  // Worst case of section B: eps 5 mm/s, D/rho = 0.667, C 60, r 0.6: phi bound and 11 um.
  TerminalSmc law;
  law.surface_gain = 60, law.switching_gain = 0.9, law.boundary_layer = 5e-3;
  law.power = {0.6, 0.1e-6, 1e-3, Regularisation::clamp};
  const double disturbance = 0.6, phi = layer_residual(5e-3, 0.9, disturbance);
  const double bound = position_residual(phi, 60, 0.6);
  EXPECT_NEAR(bound, 11e-6, 0.5e-6);
  const Motion run = simulate(law, 1e-4, 0, disturbance, 1.0, 1e-6, 1e-7);
  EXPECT_LE(run.s_end, phi * 1.001);
  EXPECT_LE(run.x_end, bound * 1.001);
  EXPECT_GE(run.s_end, 0.98 * phi);  // a constant disturbance attains it
}

/// |s| after many samples of s[i+1] = s[i] - k s[i-n], relative to the start.
double delayed_growth(double k, int n, int samples) {
  std::vector<double> s(static_cast<std::size_t>(n) + 1, 1.0);
  double peak = 0;
  for (int i = 0; i < samples; ++i) {
    const double next = s.back() - k * s[s.size() - 1 - static_cast<std::size_t>(n)];
    s.push_back(next);
    if (i > samples - 50) peak = std::max(peak, std::abs(next));
  }
  return peak;
}

TEST(DelayLimitReference, StableJustBelowAndUnstableJustAbove) {
  for (int n : {0, 1, 2, 3, 5}) {
    EXPECT_LT(delayed_growth(0.999 * stable_gain_limit(n), n, 100000), 1e-3) << n;
    EXPECT_GT(delayed_growth(1.001 * stable_gain_limit(n), n, 40000), 10) << n;
  }
  EXPECT_NEAR(stable_gain_limit(0), 2, 1e-12);
  EXPECT_NEAR(stable_gain_limit(1), 1, 1e-12);
  EXPECT_NEAR(stable_gain_limit(2), 0.618, 1e-3);
}

TEST(DelayLimitReference, NoSignChangeJustBelowAndOneJustAbove) {
  for (int n : {0, 1, 2, 3}) {
    const auto crosses = [n](double k) {
      std::vector<double> s(static_cast<std::size_t>(n) + 1, 1.0);
      for (int i = 0; i < 3000; ++i) {
        const double next = s.back() - k * s[s.size() - 1 - static_cast<std::size_t>(n)];
        if (next < 0) return true;
        s.push_back(next);
      }
      return false;
    };
    EXPECT_FALSE(crosses(0.999 * smooth_gain_limit(n))) << n;
    EXPECT_TRUE(crosses(1.001 * smooth_gain_limit(n))) << n;
  }
}

TEST(DelayLimitReference, RegularisationLengthOfTheWorkedExample) {
  EXPECT_NEAR(regularisation_limit(1e-3, 60, 0.6, 1e-3, 1), 7.9e-6, 0.1e-6);
  EXPECT_NEAR(boundary_layer_limit(1e-3, 3, 2), 6.75e-3 * 3, 1e-12);
}

TEST(TerminalPowerUnit, BlendIsContinuousWithItsSlope) {
  const TerminalPower p{0.7, 20e-6, 1e-3, Regularisation::blend};
  for (double x : {-50e-6, -20e-6, -7e-6, 0.0, 3e-6, 20e-6 * (1 - 1e-9), 20e-6 * (1 + 1e-9), 1e-3}) {
    const double step = 1e-10, numeric = (p.value(x + step) - p.value(x - step)) / (2 * step);
    EXPECT_NEAR(numeric, p.slope(x), 1e-3 * p.slope(x)) << x;
    EXPECT_DOUBLE_EQ(p.value(-x), -p.value(x));
  }
  EXPECT_NEAR(p.value(20e-6 * (1 - 1e-12)), p.value(20e-6 * (1 + 1e-12)), 1e-15);
}

TEST(TerminalPowerUnit, ValueAndSlopeOfOnePowerAreThoseOfTheFormula) {
  const double r = 0.55, delta = 20e-6, unit = 1e-3;
  const TerminalPower printed{r, 0, unit, Regularisation::none}, clamped{r, delta, unit, Regularisation::clamp},
      blended{r, delta, unit, Regularisation::blend};
  for (double x : {-2e-3, -31e-6, -5e-6, 1e-9, 19e-6, 21e-6, 0.4e-3}) {
    const double a = std::abs(x), value = std::copysign(unit * std::pow(a / unit, r), x);
    const auto slope = [&](double at) { return r * std::pow(at / unit, r - 1); };
    EXPECT_NEAR(printed.value(x), value, 1e-14 * a * slope(a));
    EXPECT_NEAR(printed.slope(x), slope(a), 1e-14 * slope(a));
    EXPECT_NEAR(clamped.value(x), value, 1e-14 * a * slope(a));
    EXPECT_NEAR(clamped.slope(x), slope(std::max(a, delta)), 1e-14 * slope(delta));
    if (a < delta) continue;
    EXPECT_NEAR(blended.value(x), value, 1e-14 * a * slope(a));
    EXPECT_NEAR(blended.slope(x), slope(a), 1e-14 * slope(a));
  }
}

TEST(TerminalPowerUnit, FieldsMayChangeAfterConstruction) {
  TerminalPower p;
  p.exponent = 0.55, p.delta = 5e-6, p.length = 2e-3;
  const TerminalPower made{0.55, 5e-6, 2e-3, Regularisation::blend};
  for (double x : {-4e-6, 1e-6, 30e-6}) {
    EXPECT_EQ(p.value(x), made.value(x));
    EXPECT_EQ(p.slope(x), made.slope(x));
  }
}

TEST(TerminalPowerUnit, ARememberedEdgeFollowsItsFields) {
  TerminalPower::Edge edge;
  for (const TerminalPower& p : {TerminalPower{}, TerminalPower{0.7, 5e-6, 1e-3, Regularisation::blend},
                                 TerminalPower{0.55, 5e-6, 1e-3, Regularisation::blend},
                                 TerminalPower{0.55, 5e-6, 2e-3, Regularisation::blend}}) {
    for (double x : {-4e-6, 1e-6, 30e-6}) {
      EXPECT_EQ(p.at(x, edge).value, p.value(x));
      EXPECT_EQ(p.at(x, edge).slope, p.slope(x));
    }
  }
}

TEST(SmoothSignReference, IsTheHyperbolicTangent) {
  for (int i = -3000; i <= 3000; ++i) {
    const double x = 1e-3 * i;
    EXPECT_NEAR(smooth_sign(x), std::tanh(x), 1e-15 * std::abs(x)) << x;
  }
  EXPECT_EQ(smooth_sign(1e-300), 1e-300);
  EXPECT_EQ(smooth_sign(HUGE_VAL), 1);
  EXPECT_TRUE(std::isnan(smooth_sign(std::nan(""))));
}

TEST(TerminalPowerUnit, ZeroIsFiniteForEveryRegularisation) {
  for (auto kind : {Regularisation::none, Regularisation::clamp, Regularisation::blend}) {
    TerminalSmc law;
    law.power = {0.55, 1e-6, 1e-3, kind};
    const AxisOutput out = law.step({0, 0.1, 0, 0});
    EXPECT_TRUE(std::isfinite(out.a));
    EXPECT_DOUBLE_EQ(out.s, 0.1);
    EXPECT_DOUBLE_EQ(law.step({0, 0, 0, 0}).a, 0);
  }
  EXPECT_EQ(sgn(0.0), 0);
  EXPECT_EQ(sig(0.0, -0.3), 0);
}

TEST(TerminalSmcReference, EquationAsPrintedInMillimetres) {
  // Paper eq. 43 evaluated by hand in mm: x = 0.3 mm, v = 5 mm/s, C = 60, r = 7/9, rho = 3000 mm/s^2, eps =
  // 100 mm/s.
  TerminalSmc law;
  law.surface_gain = 60, law.switching_gain = 3, law.boundary_layer = 0.1;
  law.power = {7.0 / 9.0, 0, 1e-3, Regularisation::none};
  const double r = 7.0 / 9.0, x = 0.3, v = 5, f = -1700;
  const double s = v + 60 * std::pow(x, r);
  const double a = -(f + 60 * r * std::pow(x, r - 1) * v + 3000 * std::tanh(s / 100));
  const AxisOutput out = law.step({x * 1e-3, v * 1e-3, f * 1e-3, 0});
  EXPECT_NEAR(out.a * 1e3, a, 1e-9 * std::abs(a));
  EXPECT_NEAR(out.s * 1e3, s, 1e-9 * s);
}

TEST(ImplicitStepProperty, PowerEquationAgainstBisection) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> log_x(-9, 3), log_g(-6, 3), exponent(0.5, 0.99);
  for (int i = 0; i < 2000; ++i) {
    const double x = std::pow(10, log_x(random)) * (i % 2 ? 1 : -1), g = std::pow(10, log_g(random));
    const double r = i % 10 == 0 ? 0.5 : exponent(random);
    double low = 0, high = std::abs(x);
    for (int k = 0; k < 200; ++k) {
      const double mid = 0.5 * (low + high);
      (mid + g * std::pow(mid, r) < std::abs(x) ? low : high) = mid;
    }
    const double z = solve_implicit_power(x, g, r);
    EXPECT_NEAR(std::abs(z), low, 1e-10 * low + 1e-300) << x << " " << g << " " << r;
    EXPECT_EQ(sgn(z), sgn(x));
  }
  EXPECT_EQ(solve_implicit_power(0, 1, 0.7), 0);
}

TEST(ImplicitStepProperty, SuperTwistingSolvesTheInclusion) {
  // s+ = s + h u with u = -k1 sig(s+)^(1/2) + w+, w+ in w - h k2 Sgn(s+), no disturbance: root by bisection
  // in s+.
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> state(-0.2, 0.2), memory(-3, 3);
  for (int i = 0; i < 2000; ++i) {
    SuperTwisting law{50, 1e9, memory(random)};
    const double h = 1e-3, s = state(random), w = law.w;
    const auto residual = [&](double next, double sign) {
      return next - s - h * (-law.k1() * sig(next, 0.5) + w - h * law.k2() * sign);
    };
    double low = -10, high = 10;
    for (int k = 0; k < 300; ++k) {
      const double mid = 0.5 * (low + high);
      (residual(mid, mid > 0 ? 1 : -1) < 0 ? low : high) = mid;
    }
    const double u = law.implicit_step(s, h);
    EXPECT_NEAR(s + h * u, 0.5 * (low + high), 1e-12) << s << " " << w;
  }
}

TEST(ImplicitStepProperty, SwitchingProjectionSolvesTheInclusion) {
  // tau = h: s+ = s - h rho xi, xi in Sgn(s+) means s+ = 0 whenever |s| <= h rho.
  ImplicitSmc law{0, 3, 1e-3};
  for (double s : {-1.0, -0.0031, -0.0029, 0.0, 1e-6, 0.0029, 0.0031, 0.5}) {
    const double next = s + 1e-3 * law.step({0, s, 0, 0}).a;
    if (std::abs(s) <= 3e-3) {
      EXPECT_NEAR(next, 0, 1e-16);
    } else {
      EXPECT_NEAR(next, s - 3e-3 * sgn(s), 1e-16);
    }
  }
}

TEST(ImplicitStepProperty, TerminalSetPointReachesTheSurfaceInOneStep) {
  // Without a bound: v+ = v* and z is the position after one step of backward Euler on the surface.
  ImplicitTerminalSmc law{20, 1e9, 1e-3, 0.6, 1e-3, 1e-3};
  double x = 1e-3, v = 0;
  const double h = 1e-3;
  double t = 0;
  while (std::abs(x) > 1e-9 && t < 1) {
    v += h * law.step({x, v, 0, 0}).a;
    x += h * v;
    t += h;
  }
  EXPECT_NEAR(t, slide_time_terminal(1e-3, 20, 0.6), 0.1 * t);
}

TEST(SuperTwistingReference, RejectsARampWithinItsGains) {
  // s' = u + phi, phi' = 0.9 L: the explicit form ends at s = 0; the implicit one, which knows of a
  // disturbance one sample late, at exactly h phi. With phi' = 3 L neither does.
  for (bool implicit : {false, true}) {
    for (double slope : {0.9, 3.0}) {
      SuperTwisting law{50, 1e9, 0};
      const double h = 1e-4;
      double s = 0.1, worst = 0;
      for (int i = 0; i < 40000; ++i) {
        const double phi = slope * 50 * h * i;
        s += h * ((implicit ? law.implicit_step(s, h) : law.explicit_step(s, h)) + phi);
        if (i > 30000) worst = std::max(worst, std::abs(s));
      }
      if (slope < 1) {
        EXPECT_LT(worst, implicit ? 1.001 * h * 0.9 * 50 * 4 : 1e-5) << implicit;
      } else {
        EXPECT_GT(worst, 5 * h * 3 * 50 * 4) << implicit;
      }
    }
  }
}

TEST(SuperTwistingReference, ImplicitVaries100TimesLessAtRest) {
  double variation[2] = {};
  for (int implicit : {0, 1}) {
    SuperTwisting law{50, 1e9, 0};
    double s = 0.01, last = 0;
    for (int i = 0; i < 20000; ++i) {
      const double u = implicit ? law.implicit_step(s, 1e-3) : law.explicit_step(s, 1e-3);
      s += 1e-3 * u;
      if (i > 10000) variation[implicit] += std::abs(u - last);
      last = u;
    }
  }
  EXPECT_LT(variation[1], variation[0] / 100);
}

TEST(AdaptiveSmcUnit, GainGrowsOutsideTheDeadZoneAndFallsInside) {
  AdaptiveSmc law;
  law.gain = 1;
  law.step({0, 2 * law.dead_zone, 0, 0});
  EXPECT_GT(law.gain, 1);
  const double grown = law.gain;
  law.step({0, 0.5 * law.dead_zone, 0, 0});
  EXPECT_LT(law.gain, grown);
  for (int i = 0; i < 100000; ++i) law.step({0, 1, 0, 0});
  EXPECT_EQ(law.gain, law.gain_max);
  law.reset();
  EXPECT_EQ(law.gain, law.gain_min);
}

TEST(BarrierSmcUnit, KeepsTheBarrierAgainstAnUnknownDisturbanceAndCapsTheGain) {
  BarrierSmc law;
  law.gain_max = 100;
  double x = 0, v = 0, worst = 0;
  for (int i = 0; i < 200000; ++i) {
    const AxisOutput out = law.step({x, v, 0, 0});
    worst = std::max(worst, std::abs(out.s));
    v += 1e-5 * (out.a + 20 * std::sin(40 * 1e-5 * i));
    x += 1e-5 * v;
  }
  EXPECT_LT(worst, law.width);
  EXPECT_GT(worst, 0.9 * law.width);
  EXPECT_DOUBLE_EQ(law.step({0, 5, 0, 0}).a, -60 * 5.0 - 100);
  EXPECT_DOUBLE_EQ(law.step({0, law.width, 0, 0}).a, -60 * law.width - 100);
}

TEST(PidUnit, IntegratorIsClamped) {
  Pid law;
  for (int i = 0; i < 100000; ++i) law.step({1e-3, 0, 0, 0});
  EXPECT_DOUBLE_EQ(law.integral, law.limit);
  EXPECT_DOUBLE_EQ(law.step({0, 0, 0, 2}).a, -law.limit - 2);
}

}  // namespace
}  // namespace whirl::control
