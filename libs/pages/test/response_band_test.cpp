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

}  // namespace
}  // namespace whirl::pages
