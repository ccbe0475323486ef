#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "folds.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/response/continuation.hpp"
#include "whirl/response/synchronous.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;

/// x'' = -k x - k3 x^3 - c x' + u.
struct Duffing {
  double c = 0.1, k = 1, k3 = 0.04, force = 1;
  IdentifiedModel model() const {
    IdentifiedModel m;
    m.states = {"x", "v"};
    m.inputs = {"u"};
    const auto term = [](const char* f, double a) { return EquationTerm{f, {a, 0, a, a}, ""}; };
    m.equations = {{"x'", {term("v", 1)}}, {"v'", {term("x", -k), term("x^3", -k3), term("v", -c), term("u", 1)}}};
    return m;
  }
  /// The two speeds of one-harmonic balance at amplitude a: ((k + 3/4 k3 a^2 - w)^2 + c^2 w) a^2 = F^2, w = Omega^2.
  double speed(double a, double sign) const {
    const double kk = k + 0.75 * k3 * a * a, b = kk - c * c / 2;
    return std::sqrt(b + sign * std::sqrt(b * b - kk * kk + force * force / (a * a)));
  }
};

CurveOptions range(double from, double to) {
  CurveOptions o;
  o.from = from;
  o.to = to;
  return o;
}

// One harmonic: every point lies on the closed form, and both folds are its extrema of speed over amplitude.
TEST(ResponseReference, DuffingOfOneHarmonicIsTheClosedForm) {
  const Duffing d;
  const PeriodicSystem system(d.model(), {"u", d.force});
  CurveOptions o = range(0.3, 3);
  o.harmonics = 1;
  o.truncation = 0;
  const ResponseCurve curve = response_curve(system, Parameter::speed, d.force, o);
  ASSERT_GT(curve.points.size(), 30U);
  for (const CurvePoint& p : curve.points) {
    const double a = std::abs(p.solution.harmonic(0, 1)), w = p.solution.omega * p.solution.omega;
    const double left = (std::pow(d.k + 0.75 * d.k3 * a * a - w, 2) + d.c * d.c * w) * a * a;
    EXPECT_NEAR(left, d.force * d.force, 1e-8);
  }
  std::vector<double> found, expected;
  for (const CurveEvent& e : curve.events)
    if (e.kind == EventKind::fold) found.push_back(e.parameter);
  // Extrema of speed(a, sign) by golden sections from brackets of the sampled curve.
  for (const double sign : {1.0, -1.0}) {
    double before = std::nan(""), last = std::nan("");
    for (double a = 0.5; a < 20; a += 1e-3) {
      const double now = d.speed(a, sign);
      if (!std::isnan(before) && !std::isnan(now) && (last - before) * (now - last) < 0) {
        double l = a - 2e-3, h = a;
        const double up = last > before ? 1 : -1;
        for (int i = 0; i < 200; ++i) {
          const double m1 = l + 0.382 * (h - l), m2 = h - 0.382 * (h - l);
          (up * d.speed(m1, sign) < up * d.speed(m2, sign) ? l : h) =
              up * d.speed(m1, sign) < up * d.speed(m2, sign) ? m1 : m2;
        }
        expected.push_back(d.speed(0.5 * (l + h), sign));
      }
      before = last;
      last = now;
    }
  }
  std::sort(found.begin(), found.end());
  std::sort(expected.begin(), expected.end());
  ASSERT_EQ(expected.size(), 2U);
  ASSERT_EQ(found.size(), 2U);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(found[k], expected[k], 1e-8);
}

// The support moves A cos(Omega t): one-harmonic balance with the force Omega^2 A, the displacement against the
// support.
TEST(ResponseReference, ASupportThatMovesIsTheClosedForm) {
  const Duffing d;
  const double support = 0.5;
  const PeriodicSystem system(d.model(), {"", support, 1, false, "x"});
  CurveOptions o = range(0.3, 3);
  o.harmonics = 1;
  o.truncation = 0;
  const ResponseCurve curve = response_curve(system, Parameter::speed, support, o);
  ASSERT_GT(curve.points.size(), 30U);
  for (const CurvePoint& p : curve.points) {
    const double a = std::abs(p.solution.harmonic(0, 1)), w = p.solution.omega * p.solution.omega;
    const double left = (std::pow(d.k + 0.75 * d.k3 * a * a - w, 2) + d.c * d.c * w) * a * a;
    EXPECT_NEAR(left / (w * w * support * support), 1, 1e-8) << p.solution.omega;
  }
  EXPECT_THROW(PeriodicSystem(d.model(), {"", 1, 1, false, "v"}), Error);
}

RotorModel rotor() {
  RotorModel m;
  m.k1 = 8882.6;
  m.k2 = 2e8;
  m.c = 7.5;
  m.eps = std::polar(1e-4, 0.4);
  return m;
}

// The isotropic rotor's circle is one harmonic exactly: the continuation of the equations against the algebra.
TEST(ResponseReference, IsotropicRotorAgreesWithTheAlgebraAndItsFolds) {
  RotorModel r = rotor();
  r.eps = std::polar(3e-4, 0.4);
  const PeriodicSystem system(rotor_equations(r), {});
  const ResponseCurve curve = response_curve(system, Parameter::speed, 0, range(40, 200));
  int unstable = 0;
  for (const CurvePoint& p : curve.points) {
    double nearest = 1;
    bool stable = false;
    for (const SynchronousPoint& s : synchronous_answers(r, p.solution.omega)) {
      const double off = std::abs(s.radius - std::abs(p.solution.harmonic(0, 1))) / s.radius;
      if (off < nearest) nearest = off, stable = s.stable;
    }
    EXPECT_LT(nearest, 1e-8) << p.solution.omega;
    if (std::abs(p.multiplier - 1) > 1e-4) {
      EXPECT_EQ(stable, p.stable) << p.solution.omega;
    }
    unstable += !p.stable;
  }
  EXPECT_GT(unstable, 3);
  const std::vector<double> folds = synchronous_folds(r, 40, 200);
  std::vector<double> found;
  for (const CurveEvent& e : curve.events)
    if (e.kind == EventKind::fold) found.push_back(e.parameter);
  std::sort(found.begin(), found.end());
  ASSERT_EQ(folds.size(), 2U);
  ASSERT_EQ(found.size(), 2U);
  for (int k = 0; k < 2; ++k) EXPECT_NEAR(found[k] / folds[k], 1, 1e-8);
}

// Fifty stable points of an anisotropic nonlinear rotor, by time integration from a point of the curve itself.
TEST(ResponseReference, StablePointsAreWhatTimeIntegrationSettlesOn) {
  RotorModel r = rotor();
  r.k1_conj = {300, 120};
  r.eps = 5e-5;
  const IdentifiedModel model = rotor_equations(r);
  const PeriodicSystem system(model, {});
  const ResponseCurve curve = response_curve(system, Parameter::speed, 0, range(40, 200));
  std::vector<const CurvePoint*> stable;
  for (const CurvePoint& p : curve.points)
    if (p.stable && p.multiplier < 0.999) stable.push_back(&p);
  ASSERT_GE(stable.size(), 50U);
  for (std::size_t k = 0; k < 50; ++k) {
    const PeriodicSolution& s = stable[k * stable.size() / 50]->solution;
    const std::complex<double> z0(s.coefficients.col(0)(0), 0);
    const auto at = [&](double tau) {
      Eigen::Vector4d v = Eigen::Vector4d::Zero();
      for (int h = 0; h <= s.harmonics(); ++h)
        for (Index i = 0; i < 2; ++i) {
          const std::complex<double> e = s.harmonic(i, h) * std::polar(1.0, h * tau);
          v[2 * i] += e.real();
          v[2 * i + 1] += (e * std::complex<double>(0, h * s.omega)).real();
        }
      return v;
    };
    Eigen::Vector4d v = 1.01 * at(0);  // one percent off, then 150 turns
    constexpr int kSteps = 200, kTurns = 150;
    const double dt = 2 * std::numbers::pi / s.omega / kSteps;
    const auto rate = [&](double t, const Eigen::Vector4d& q) {
      const double beta = s.omega * t;
      const std::complex<double> f = std::polar(s.omega * s.omega, beta);
      const std::complex<double> a = rotor::lateral_acceleration(r, {q[0], q[2]}, {q[1], q[3]}, f);
      return Eigen::Vector4d(q[1], a.real(), q[3], a.imag());
    };
    double worst = 0;
    for (int step = 0; step < kSteps * kTurns; ++step) {
      v = rk4_step(rate, step * dt, v, dt);
      if (step >= kSteps * (kTurns - 1))
        worst = std::max(worst, (v - at(2 * std::numbers::pi * (step + 1) / kSteps)).head(1).cwiseAbs()[0]);
    }
    EXPECT_LT(worst, 2e-3 * ResponseCurve::radius(s))
        << s.omega << " multiplier " << stable[k * stable.size() / 50]->multiplier;
  }
}

TEST(ResponseReference, BackboneAndPeakOfTheRotor) {
  const RotorModel r = rotor();
  const SynchronousPoint peak = synchronous_peak(r, 40, 400);
  // At quadrature c Omega A = e Omega^2 with Omega on the backbone; the peak lies beside it by a part of the order of
  // the damping ratio squared.
  EXPECT_NEAR(backbone(r, peak.radius) / peak.omega, 1, 4e-3);
  EXPECT_NEAR(r.c * peak.radius / (std::abs(r.eps) * peak.omega), 1, 4e-3);
}

TEST(Response, BadRequestsAreRefused) {
  const Duffing d;
  EXPECT_NE(testing::error_of([&] { PeriodicSystem(d.model(), {"w", 1.0}); }).find("u"), std::string::npos);
  const PeriodicSystem system(d.model(), {"u", 1.0});
  EXPECT_NE(testing::error_of([&] { response_curve(system, Parameter::speed, 1, range(0, 3)); }).find("> 0"),
            std::string::npos);
  IdentifiedModel map = d.model();
  map.equations[0].lhs = "x[k+1]";
  EXPECT_NE(testing::error_of([&] { PeriodicSystem(map, {"u", 1.0}); }).find("map"), std::string::npos);
}

}  // namespace
}  // namespace whirl::response
