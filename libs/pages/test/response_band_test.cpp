#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "whirl/response/decay.hpp"
#include "whirl/testing/control/identified_machine.hpp"
#include "whirl/testing/systems/response_coverage.hpp"

namespace whirl::pages {
namespace {

using testing::Oddity;

// bench_pages_response_band has the same on many machines. Points of one machine go together: those of one may be out.
TEST(ResponseBandProperty, TheTrueResponseOfRotorsWithFurtherForcesLiesInTheBand) {
  testing::BandCoverage c;
  for (std::size_t k = 0; k < testing::kBandKinds.size(); k += 2)
    testing::cover_response(testing::kBandKinds[k], 9100 + 10 * k, 20, c);
  EXPECT_EQ(c.machines, 4);
  EXPECT_EQ(c.without, 0);
  EXPECT_GE(c.inside, c.points - 8);
}

IdentifiedModel with_scatter() {
  IdentifiedModel model = testing::identified(testing::machine());
  model.rotor_covariance.assign(25, 0.0);
  model.rotor_covariance[0] = 400;
  model.rotor_covariance[12] = 0.01;
  model.rotor_covariance[18] = model.rotor_covariance[24] = 4e-12;
  return model;
}

// A rotor with a further force of almost nothing has the band of the rotor without it, which is algebraic.
TEST(ResponseBandReference, AForceOfAlmostNothingLeavesTheBandOfTheClosedForm) {
  const IdentifiedModel plain = with_scatter();
  IdentifiedModel more = plain;
  more.parameters.emplace_back("c2", Estimate::from_sd(1e-9, 1e-10));
  SteadyOptions o;
  o.curve.from = 30;
  o.curve.to = 70;
  const SteadyResponse a = steady_response(plain, o), b = steady_response(more, o);
  ASSERT_TRUE(a.band && b.band);
  EXPECT_EQ(b.band->lost, 0);
  for (const Eigen::Index k : {0L, 60L, 120L, 199L}) {
    const double width = a.band->high[k] - a.band->low[k];
    EXPECT_NEAR(b.band->low[k], a.band->low[k], 0.12 * width) << k;
    EXPECT_NEAR(b.band->high[k], a.band->high[k], 0.12 * width) << k;
  }
}

// The stated unbalance is a part of the identified one, so its deviation is too.
TEST(ResponseBandProperty, TheBandOfAPartOfTheUnbalanceIsThatPartOfTheBand) {
  IdentifiedModel linear = with_scatter();
  linear.rotor->k2 = 0;
  IdentifiedModel more = linear;
  more.parameters.emplace_back("gyroscopic", Estimate::from_sd(1e-3, 1e-4));
  for (const IdentifiedModel& model : {linear, more}) {
    SteadyOptions whole, part;
    whole.curve.from = part.curve.from = 30;
    whole.curve.to = part.curve.to = 70;
    part.unbalance = 0.25;
    const SteadyResponse a = steady_response(model, whole), b = steady_response(model, part);
    ASSERT_TRUE(a.band && b.band);
    EXPECT_NEAR(b.band->high[100], 0.25 * a.band->high[100], 1e-3 * a.band->high[100]);
    EXPECT_NEAR(b.band->low[100], 0.25 * a.band->low[100], 1e-3 * a.band->low[100]);
  }
}

// x'' + c x' + k x + g x^3 = u: coefficients of a general model, known jointly. Where the spring is all that is open,
// and stiffness and damping are fixed, the static deflection tells the band.
TEST(ResponseBandReference, AGeneralModelHasTheBandOfItsJointCovariance) {
  IdentifiedModel model;
  model.states = {"x", "v"};
  model.inputs = {"u"};
  const double k = 900, c = 2, sd = 9, other = 0.02;
  model.equations = {{"x'", {{"v", Estimate::from_sd(1, 0), ""}}},
                     {"v'",
                      {{"x", Estimate::from_sd(-k, sd), ""},
                       {"v", Estimate::from_sd(-c, other), ""},
                       {"u", Estimate::from_sd(1, 0.01), ""}}}};
  model.parameters = {{"v': x", Estimate::from_sd(-k, sd)},
                      {"v': v", Estimate::from_sd(-c, other)},
                      {"v': u", Estimate::from_sd(1, 0.01)}};
  SteadyOptions o;
  o.curve.from = 0.5;
  o.curve.to = 3;
  o.input = "u";
  o.amplitude = 1;
  // Far below the resonance |x| = g / k: known to sqrt(0.01^2 + 0.01^2) when apart, not at all moved when g and k go
  // together.
  for (const double together : {0.0, 1.0}) {
    model.parameter_covariance = {sd * sd, 0,   -together * sd * 0.01, 0, other * other, 0, -together * sd * 0.01,
                                  0,       1e-4};
    const SteadyResponse r = steady_response(model, o);
    ASSERT_TRUE(r.band);
    const double width = (r.band->high[0] - r.band->low[0]) * k / (2 * 1.96);
    EXPECT_NEAR(width, together > 0 ? 0 : std::sqrt(2) * 0.01, 0.0015);
  }
}

// k1 and k3 of a decay are known together far better than each alone: the band at the amplitudes of the decay is
// narrow.
TEST(ResponseBandProperty, AModeOfADecayHasTheBandOfItsParametersTogether) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  response::DecayCurve curve;
  const double k1 = 3600, k3 = 4e8, c = 0.8;
  for (int i = 0; i < 20; ++i) {
    const double a = 1.2e-3 * std::exp(-0.01 * i), w = std::sqrt(k1 + 0.75 * k3 * a * a);
    const double fall = (k1 + 0.75 * k3 * a * a) / (k1 + k3 * a * a);
    curve.points.push_back(
        {0.4 * i, a, w + 0.01 * normal(random), 0.01, 0.5 * c * fall + 0.005 * normal(random), 0.005});
  }
  const response::NonlinearMode mode = response::fit_decay(curve);
  ASSERT_NE(mode.k3.value, 0);
  IdentifiedModel apart = mode.model();
  ASSERT_EQ(apart.parameter_covariance.size(), 9U);
  SteadyOptions o;
  o.curve.from = 55;
  o.curve.to = 66;
  o.input = "u";
  o.amplitude = 0.045;  // up to 1 mm
  const SteadyResponse together = steady_response(mode.model(), o);
  apart.parameter_covariance.clear();
  const SteadyResponse alone = steady_response(apart, o);
  ASSERT_TRUE(together.band && alone.band);
  const auto width = [](const SteadyResponse& r) { return r.band->high[120] - r.band->low[120]; };  // at 0.85 mm
  EXPECT_LT(width(together), 0.6 * width(alone));
}

// An anisotropic hardening rotor has unstable responses above the stable ones: they are none that a rotor shows.
TEST(ResponseBandProperty, UnstableResponsesAreNotInTheBand) {
  IdentifiedModel model = with_scatter();
  model.rotor->k1_conj = {113, 27};
  model.rotor->k2 = 1e7;
  model.rotor->eps = 3.2e-4;
  model.rotor->c = 1;
  model.rotor_covariance[12] = 1e-8;
  SteadyOptions o;
  o.curve.from = 32;
  o.curve.to = 198;
  const SteadyResponse r = steady_response(model, o);
  ASSERT_TRUE(r.band);
  int above = 0;
  std::vector<response::ResponseCurve> curves = r.branches;
  curves.push_back(r.curve);
  for (const response::ResponseCurve& curve : curves) {
    for (const response::CurvePoint& p : curve.points) {
      const double at = (p.solution.omega - r.band->omega[0]) / (r.band->omega[1] - r.band->omega[0]);
      const double high = r.band->high[std::clamp<Eigen::Index>(static_cast<Eigen::Index>(at + 0.5), 0, 199)];
      above += !p.stable && response::ResponseCurve::radius(p.solution) > 1.1 * high;
    }
  }
  EXPECT_GT(above, 3);
}

// Folds move with the rest: the end of the upper branch is where draws of it end.
TEST(ResponseBandProperty, TheBandHasTheFoldsOfTheDrawnRotors) {
  IdentifiedModel model = with_scatter();
  model.rotor->c = 2;
  model.parameters.emplace_back("gyroscopic", Estimate::from_sd(1e-6, 1e-7));
  SteadyOptions o;
  o.curve.from = 40;
  o.curve.to = 160;
  const SteadyResponse r = steady_response(model, o);
  ASSERT_TRUE(r.band);
  double fold = 0;
  for (const response::CurveEvent& e : r.curve.events)
    if (e.kind == response::EventKind::fold) fold = std::max(fold, e.solution.omega);
  ASSERT_GT(fold, 80);
  IdentifiedModel plain = model;
  plain.parameters.pop_back();
  const SteadyResponse truth = steady_response(plain, o);
  int off = 0;
  for (Eigen::Index k = 0; k < 200; ++k) {
    const double high = truth.band->high[k], width = high - truth.band->low[k];
    off += std::abs(r.band->high[k] - high) > 0.15 * width + 0.01 * high;
  }
  EXPECT_LE(off, 4);  // at the ends of the upper branch a quantile jumps
}

/// A lightly damped rotor, the model that records of it could have given, and the answer of a linear one: e Omega / c.
struct LightlyDamped {
  IdentifiedModel model;
  double peak = 0;  ///< of the true rotor, m
  double critical = 0;
};

LightlyDamped lightly_damped(std::mt19937_64& random, bool further_force) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  LightlyDamped l;
  l.critical = 120 + 120 * uniform(random);
  const double zeta = 0.002 * std::pow(10, uniform(random)), e = 2e-5, open = 0.01 + 0.05 * uniform(random);
  testing::Machine machine;
  machine.k = l.critical * l.critical, machine.cubic = 0, machine.c = 2 * zeta * l.critical, machine.e = e;
  l.model = testing::identified(machine);
  if (further_force) l.model.parameters.emplace_back("gyroscopic", Estimate::from_sd(1e-9, 1e-10));
  RotorModel& rotor = *l.model.rotor;
  l.peak = e / (2 * zeta * std::sqrt(1 - zeta * zeta));
  const double sd_k = 1e-5 * rotor.k1, sd_c = open * rotor.c, sd_e = 0.002 * e;
  rotor.k1 += sd_k * normal(random), rotor.c += sd_c * normal(random), rotor.eps += sd_e * normal(random);
  l.model.rotor_covariance.assign(25, 0.0);
  l.model.rotor_covariance[0] = sd_k * sd_k, l.model.rotor_covariance[12] = sd_c * sd_c;
  l.model.rotor_covariance[18] = l.model.rotor_covariance[24] = sd_e * sd_e;
  return l;
}

SteadyResponse up_to(const LightlyDamped& l, double times_critical) {
  SteadyOptions o;
  o.curve.from = 0.15 * l.critical;
  o.curve.to = times_critical * l.critical;
  return steady_response(l.model, o);
}

// A resonance of a thousandth of the range lies between the speeds of a band: the interval of the largest response is
// that of each drawn rotor's own peak.
TEST(ResponseBandProperty, TheLargestResponseOfLightlyDampedRotorsLiesInAnIntervalThatNoRangeChanges) {
  std::mt19937_64 random(77);
  int rotors = 0, covered = 0;
  for (const bool further : {false, true}) {
    for (int k = 0; k < (further ? 3 : 30); ++k, ++rotors) {
      const LightlyDamped l = lightly_damped(random, further);
      const SteadyResponse near = up_to(l, 1.6), wide = up_to(l, 6.4);
      ASSERT_TRUE(near.band && wide.band);
      const RotorModel& r = *l.model.rotor;
      const double zeta = r.c / (2 * std::sqrt(r.k1)), own = std::abs(r.eps) / (2 * zeta * std::sqrt(1 - zeta * zeta));
      for (const SteadyResponse* found : {&near, &wide}) {
        double most = 0;
        for (const response::CurvePoint& p : found->curve.points) most = std::max(most, found->amplitude(p.solution));
        EXPECT_NEAR(most / own, 1, 1e-6) << k;
        EXPECT_LT(found->band->peak_low, most) << k;
        EXPECT_GT(found->band->peak_high, most) << k;
      }
      const double width = near.band->peak_high - near.band->peak_low, close = (further ? 1e-2 : 1e-6) * width;
      EXPECT_NEAR(wide.band->peak_low, near.band->peak_low, close) << k;
      EXPECT_NEAR(wide.band->peak_high, near.band->peak_high, close) << k;
      covered += near.band->peak_low <= l.peak && l.peak <= near.band->peak_high;
    }
  }
  EXPECT_GE(covered, 0.88 * rotors);  // 95 % of 33, less two deviations
}

// What is known well has a narrow interval, and the answer lies in it all the same.
TEST(ResponseBandProperty, AWellKnownRotorsLargestResponseLiesInItsInterval) {
  std::mt19937_64 random(78);
  for (const double cubic : {0.0, 2e6, -2e5}) {
    for (int k = 0; k < 8; ++k) {
      LightlyDamped l = lightly_damped(random, false);
      l.model.rotor->k2 = cubic;
      for (double& v : l.model.rotor_covariance) v *= 1e-6;
      const SteadyResponse found = up_to(l, 3);
      ASSERT_TRUE(found.band);
      double most = 0;
      for (const response::CurvePoint& p : found.curve.points)
        if (p.stable) most = std::max(most, found.amplitude(p.solution));
      EXPECT_LT(found.band->peak_low, most) << k << ' ' << cubic;
      EXPECT_GT(found.band->peak_high, most) << k << ' ' << cubic;
    }
  }
}

// The band of the figure passes over the peak of the curve, however narrow.
TEST(ResponseBandProperty, TheBandOverSpeedReachesTheTopOfANarrowResonance) {
  std::mt19937_64 random(79);
  for (int k = 0; k < 8; ++k) {
    const LightlyDamped l = lightly_damped(random, k % 2 == 1);
    const SteadyResponse found = up_to(l, 1.6);
    ASSERT_TRUE(found.band);
    EXPECT_GT(found.band->high.maxCoeff(), 0.9 * found.band->peak_high) << k;
  }
}

}  // namespace
}  // namespace whirl::pages
