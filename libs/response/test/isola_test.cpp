#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/response/continuation.hpp"
#include "whirl/response/sweep_peaks.hpp"
#include "whirl/response/synchronous.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

IdentifiedModel isola_model(std::vector<std::string> states, std::vector<Equation> equations) {
  IdentifiedModel m;
  m.states = std::move(states);
  m.inputs = {"u"};
  m.equations = std::move(equations);
  return m;
}
EquationTerm term(const char* f, double a) { return {f, {a, 0, a, a}, ""}; }

/// x'' + (c - c2 x^2 + c4 x^4) x' + x + k3 x^3 = F cos: damping that first falls and then grows with the amplitude.
struct Isolated {
  double c = 0.1, c2 = 0.08, c4 = 0.00941, k3 = 0.05;
  IdentifiedModel model() const {
    return isola_model(
        {"x", "v"},
        {{"x'", {term("v", 1)}},
         {"v'",
          {term("x", -1), term("x^3", -k3), term("v", -c), term("x^2*v", c2), term("x^4*v", -c4), term("u", 1)}}});
  }
  double damping(double a) const { return c - c2 * a * a / 4 + c4 * std::pow(a, 4) / 8; }
  /// F^2 of one-harmonic balance at amplitude a and w = Omega^2.
  double force2(double a, double w) const {
    const double k = 1 + 0.75 * k3 * a * a;
    return a * a * ((k - w) * (k - w) + damping(a) * damping(a) * w);
  }
};

// One harmonic: the closed form says for which forces an isola exists, and every point of it lies on the closed form.
TEST(IsolaReference, FoundWhereTheClosedFormHasOneAndOnlyThere) {
  const Isolated d;
  // Force at the top of the resonance over amplitude: an isola between its local maximum and minimum.
  double highest = 0, lowest = 1e9, at_low = 0;
  for (double a = 0.05; a < 4; a += 0.001) {
    // F^2 is smallest over the speed at w = k - damping^2 / 2.
    const double e = d.damping(a), f = std::sqrt(d.force2(a, 1 + 0.75 * d.k3 * a * a - e * e / 2));
    if (a < 2) highest = std::max(highest, f);
    if (a > 2 && a < 3.6 && f < lowest) lowest = f, at_low = a;
  }
  ASSERT_LT(lowest, 0.9 * highest) << at_low;
  for (const double part : {0.6, 0.9, 1.08, 1.3}) {
    const double force = part < 1     ? lowest * (part < 0.7 ? 0.6 : 0.95)
                         : part < 1.2 ? lowest + 0.4 * (highest - lowest)
                                      : 1.2 * highest;
    const bool expected = force > lowest && force < highest;
    const PeriodicSystem system(d.model(), {"u", force});
    CurveOptions o;
    o.from = 0.5;
    o.to = 1.8;
    o.harmonics = 1;
    o.truncation = 0;
    const ResponseCurve main = response_curve(system, Parameter::speed, force, o);
    const std::vector<ResponseCurve> isolas = find_isolas(system, main, force, o, {}, 40, 4);
    EXPECT_EQ(isolas.size(), expected ? 1U : 0U) << force << " of " << lowest << " to " << highest;
    for (const ResponseCurve& isola : isolas) {
      EXPECT_TRUE(isola.closed);
      int folds = 0, stable = 0;
      for (const CurveEvent& e : isola.events) folds += e.kind == EventKind::fold;
      EXPECT_EQ(folds, 2);
      for (const CurvePoint& p : isola.points) {
        stable += p.stable;
        const double a = std::abs(p.solution.harmonic(0, 1));
        EXPECT_NEAR(d.force2(a, p.solution.omega * p.solution.omega), force * force, 1e-8 * force * force);
      }
      EXPECT_GT(stable, 3);  // the upper side can be reached by a blow
    }
  }
}

/// Two modes at 1 and nearly 3 with coupled cubic springs (potential): the third harmonic of the first drives the
/// second.
IdentifiedModel internal_resonance() {
  // V = k3/4 x^4 + b x^3 y + g/2 x^2 y^2 + h/4 y^4
  return isola_model(
      {"x", "vx", "y", "vy"},
      {{"x'", {term("vx", 1)}},
       {"vx'",
        {term("x", -1), term("vx", -0.02), term("x^3", -0.1), term("x^2*y", -0.15), term("x*y^2", -0.1), term("u", 1)}},
       {"y'", {term("vy", 1)}},
       {"vy'", {term("y", -9.3), term("vy", -0.03), term("x^3", -0.05), term("x^2*y", -0.1), term("y^3", -0.1)}}});
}

// 1:3 internal resonance: the second mode takes energy through the third harmonic, and the stable points of the curve
// are what time integration settles on.
TEST(ResponseReference, OneToThreeInternalResonance) {
  const double force = 0.06;
  const PeriodicSystem system(internal_resonance(), {"u", force});
  CurveOptions o;
  o.from = 0.8;
  o.to = 1.35;
  o.harmonics = 5;
  const ResponseCurve curve = response_curve(system, Parameter::speed, force, o);
  double third = 0;
  std::vector<const CurvePoint*> stable;
  const Index y = curve.names[0] == "y" ? 0 : 1;
  for (const CurvePoint& p : curve.points) {
    third = std::max(third, std::abs(p.solution.harmonic(y, 3)) / std::abs(p.solution.harmonic(1 - y, 1)));
    if (p.stable && p.multiplier < 0.97) stable.push_back(&p);
  }
  EXPECT_GT(third, 0.1);  // far above the 0.005 of a second mode elsewhere
  std::size_t folds = 0;
  for (const CurveEvent& e : curve.events) folds += e.kind == EventKind::fold;
  std::cout << "1:3: " << curve.points.size() << " points, " << folds << " folds, third harmonic " << third << "\n";
  ASSERT_GT(stable.size(), 30U);
  int good = 0, tried = 0;
  for (std::size_t k = 0; k < stable.size(); k += stable.size() / 20) {
    const PeriodicSolution& s = stable[k]->solution;
    const Eigen::MatrixXd orbit = s.orbit(512);
    // State at tau = 0 with a push of 1 %, 120 turns by Runge-Kutta of its own.
    Eigen::Vector4d state;
    Eigen::Vector2d v = Eigen::Vector2d::Zero();
    for (int h = 1; h <= s.harmonics(); ++h)
      for (Index i = 0; i < 2; ++i) v[i] += h * s.omega * s.coefficients(2 * h, i);
    state << orbit(0, 1 - y), v[1 - y], orbit(0, y), v[y];
    state *= 1.01;
    const auto rate = [&](const Eigen::Vector4d& q, double t) {
      const double a = q[0], b = q[2];
      return Eigen::Vector4d(
          q[1], -a - 0.02 * q[1] - 0.1 * a * a * a - 0.15 * a * a * b - 0.1 * a * b * b + force * std::cos(s.omega * t),
          q[3], -9.3 * b - 0.03 * q[3] - 0.05 * a * a * a - 0.1 * a * a * b - 0.1 * b * b * b);
    };
    const double h = 2 * std::numbers::pi / s.omega / 200;
    double t = 0, peak = 0;
    for (int n = 0; n < 200 * 140; ++n, t += h) {
      const Eigen::Vector4d k1 = rate(state, t), k2 = rate(state + h / 2 * k1, t + h / 2),
                            k3 = rate(state + h / 2 * k2, t + h / 2), k4 = rate(state + h * k3, t + h);
      state += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      if (n >= 200 * 138) peak = std::max(peak, std::abs(state[0]));
    }
    ++tried;
    good += std::abs(peak - orbit.col(1 - y).cwiseAbs().maxCoeff()) < 2e-3 * peak;
  }
  EXPECT_GE(tried, 20);
  EXPECT_EQ(good, tried);
}

// A range that ends below the upper fold: the curve from below does not come back, and the lower branch is found from
// the other end.
TEST(Response, TheLowerBranchIsFoundWhenTheCurveLeavesTheRange) {
  RotorModel m;
  m.k1 = 8882.6;
  m.k2 = 2e8;
  m.c = 7.5;
  m.eps = 3e-4;
  const PeriodicSystem system(rotor_equations(m), {});
  CurveOptions o;
  o.from = 40;
  o.to = 200;
  EXPECT_TRUE(other_branches(system, response_curve(system, Parameter::speed, 0, o), 0, o).empty());
  const ResponseCurve whole = response_curve(system, Parameter::speed, 0, o);
  ASSERT_EQ(whole.events.size(), 2U);
  o.to = 0.5 * (whole.events[0].parameter + whole.events[1].parameter);
  const ResponseCurve main = response_curve(system, Parameter::speed, 0, o);
  EXPECT_TRUE(main.events.empty());
  const std::vector<ResponseCurve> others = other_branches(system, main, 0, o);
  ASSERT_EQ(others.size(), 1U);
  EXPECT_EQ(others[0].events.size(), 1U);  // the lower fold
  const double low = ResponseCurve::radius(others[0].points.front().solution),
               high = ResponseCurve::radius(main.points.back().solution);
  EXPECT_LT(low, 0.5 * high);
  // Slow sweeps: upwards on the main curve, downwards on the other until its fold.
  const SweepPeak peak = sweep_peak(main, ResponseCurve::radius, others);
  EXPECT_NEAR(peak.up, high, 1e-9);
  EXPECT_LT(peak.down, 0.9 * high);
  EXPECT_TRUE(peak.jumps);
}

// The force of a curve scales the unbalance: the curve over speed with factor 2 is that of twice the eccentricity.
TEST(Response, TheForceOfACurveScalesTheUnbalance) {
  RotorModel m;
  m.k1 = 8882.6;
  m.k2 = 2e8;
  m.c = 7.5;
  m.eps = 1e-4;
  const PeriodicSystem free(rotor_equations(m), {"", 0, 1, true}), twice(rotor_equations(m), {"", 0, 2});
  CurveOptions o;
  o.from = 60;
  o.to = 140;
  const ResponseCurve a = response_curve(free, Parameter::speed, 2, o),
                      b = response_curve(twice, Parameter::speed, 0, o);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t k = 0; k < a.points.size(); ++k)
    EXPECT_NEAR(ResponseCurve::radius(a.points[k].solution), ResponseCurve::radius(b.points[k].solution), 1e-12);
  o.from = 1e-3;
  o.to = 3;
  EXPECT_GT(response_curve(free, Parameter::force, 110, o).points.size(), 10U);
}

// A softening spring lets go at large amplitude: curves of many forces end there, which is said once.
TEST(Response, CurvesThatEndEarlyAreOneWarning) {
  const IdentifiedModel model = isola_model(
      {"x", "v"}, {{"x'", {term("v", 1)}}, {"v'", {term("x", -1), term("x^3", 0.5), term("v", -0.1), term("u", 1)}}});
  const PeriodicSystem system(model, {"u", 1});
  CurveOptions o;
  o.from = 0.1;
  o.to = 3;
  const PeakCurve peaks = peak_over_force(system, Eigen::VectorXd::LinSpaced(20, 0.05, 2), o,
                                          [](const PeriodicSolution& s) { return std::abs(s.harmonic(0, 1)); });
  EXPECT_GT(peaks.up.array().isNaN().count(), 1);
  EXPECT_EQ(peaks.summary.warnings.size(), 1U);
}

// Duffing of one harmonic, hardening: a slow sweep upwards meets the top of the resonance, one downwards the value on
// the other side of the lower fold; jumps begin at the known critical force.
TEST(ResponseReference, PeaksOfSlowSweepsOverTheForce) {
  const double c = 0.1, k3 = 0.04;
  const IdentifiedModel model = isola_model(
      {"x", "v"}, {{"x'", {term("v", 1)}}, {"v'", {term("x", -1), term("x^3", -k3), term("v", -c), term("u", 1)}}});
  const PeriodicSystem system(model, {"u", 1});
  CurveOptions o;
  o.from = 0.3;
  o.to = 3;
  o.harmonics = 1;
  o.truncation = 0;
  o.longest_step = 0.01;
  const Eigen::VectorXd force = Eigen::VectorXd::LinSpaced(20, 0.05, 1);
  const PeakCurve peaks =
      peak_over_force(system, force, o, [](const PeriodicSolution& s) { return std::abs(s.harmonic(0, 1)); });
  // Bistable from the smallest force for which speed over amplitude has two extrema on one side.
  double first = 0;
  for (double f = 0.02; f < 1 && first == 0; f += 0.002) {
    double last = 0;
    for (double a = 0.01; a < 10; a += 0.002) {
      const double k = 1 + 0.75 * k3 * a * a, b = k - c * c / 2, root = b * b - k * k + f * f / (a * a);
      if (root < 0) break;
      const double high = b + std::sqrt(root);
      if (last > 0 && high > last) first = f;
      last = high;
    }
  }
  EXPECT_NEAR(peaks.jump_from, first, 0.06);
  for (Index i = 0; i < force.size(); ++i) {
    // Top: a^2 c^2 (k - c^2 / 4) = F^2 with k = 1 + 0.75 k3 a^2.
    double low = 0, high = 20;
    for (int n = 0; n < 60; ++n) {
      const double a = (low + high) / 2;
      (a * a * c * c * (1 + 0.75 * k3 * a * a - c * c / 4) < force[i] * force[i] ? low : high) = a;
    }
    EXPECT_NEAR(peaks.up[i], low, 0.01 * low) << force[i];
    EXPECT_NEAR(peaks.largest[i], low, 0.01 * low);
    if (force[i] > first + 0.1) {
      // Falling speed: the right side turns at its lowest speed, and the sweep lands on the left side there.
      const auto side = [&](double a, double sign) {
        const double k = 1 + 0.75 * k3 * a * a, b = k - c * c / 2;
        return b + sign * std::sqrt(std::max(0.0, b * b - k * k + force[i] * force[i] / (a * a)));
      };
      double turn = 1e9, landing = 0;
      for (double a = 0.05; a < low; a += 0.001) turn = std::min(turn, side(a, 1));
      for (double a = 0.05; a < low; a += 0.001)
        if (side(a, -1) <= turn) landing = a;
      EXPECT_NEAR(peaks.down[i], landing, 0.02 * landing) << force[i];
    }
    EXPECT_LE(peaks.down[i], peaks.up[i] * (1 + 1e-9));
  }
}

}  // namespace
}  // namespace whirl::response
