#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "whirl/core/decompositions.hpp"
#include "whirl/rig/records.hpp"

namespace whirl::rig {
namespace {

TEST(StiffnessTestReference, CubicFitFindsTheShaft) {
  RigParameters p;
  const StiffnessTable t = simulate_stiffness_test(p);
  ASSERT_EQ(t.force.size(), 49);
  const Eigen::ArrayXd d = t.deflection.array() - 15e-6;
  Eigen::MatrixXd a(49, 2);
  a.col(0) = d;
  a.col(1) = d.cube();
  const Eigen::Vector2d k = a.colPivHouseholderQr().solve(t.force);
  EXPECT_NEAR(k[0], 8500 * 1.02, 0.01 * 8500);
  EXPECT_NEAR(k[1], 1.5e7, 0.1 * 1.5e7);
  // Along y the shaft is softer; at 45 degrees the cross stiffness counts.
  StiffnessTestOptions exact{.direction = M_PI / 2,
                             .max_deflection = 1e-3,
                             .points = 2,
                             .unloading = false,
                             .force_resolution = 0,
                             .force_noise = 0,
                             .deflection_resolution = 0,
                             .zero_offset = 0};
  EXPECT_NEAR(simulate_stiffness_test(p, exact).force[1], 8500 * 0.98e-3 + 1.5e7 * 1e-9, 1e-12);
  exact.direction = M_PI / 4;
  EXPECT_NEAR(simulate_stiffness_test(p, exact).force[1], 8540e-3 + 1.5e7 * 1e-9, 1e-12);
}

TEST(StiffnessTestProperty, ReadingsHaveTheResolutionOfTheInstruments) {
  const StiffnessTable t = simulate_stiffness_test({});
  for (Eigen::Index i = 0; i < t.force.size(); ++i) {
    EXPECT_NEAR(t.force[i] / 0.0445, std::round(t.force[i] / 0.0445), 1e-6);
    EXPECT_NEAR(t.deflection[i] / 10e-6, std::round(t.deflection[i] / 10e-6), 1e-6);
  }
  EXPECT_NE(simulate_stiffness_test({}, {.seed = 2}).force, t.force);
}

std::complex<double> line(const Eigen::VectorXd& x, double dt, double frequency) {
  std::complex<double> sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i)
    sum += x[i] * std::polar(dt, -2 * M_PI * frequency * dt * static_cast<double>(i));
  return sum;
}

// Accelerance of the linear part: paper eq. 20 for the rotor's two modes and the structure.
std::complex<double> accelerance(const RigParameters& p, double frequency, double c, double k) {
  const std::complex<double> s(0, 2 * M_PI * frequency);
  std::complex<double> h = 1.0 / (p.rotor.mass * s * s + c * s + k);
  for (const RigMode& m : p.modes) {
    const double w = 2 * M_PI * m.frequency;
    h += m.sensor_sign * m.participation / p.rotor.mass / (s * s + 2 * m.damping_ratio * w * s + w * w);
  }
  return s * s * h;
}

TEST(HammerTestReference, SpectrumRatioIsTheAccelerance) {
  RigParameters p;
  p.rotor.cubic = 0;
  p.rotor.cross_stiffness = 0;
  p.rotor.damping = 15;  // the motion must end inside the record
  for (RigMode& m : p.modes) m.damping_ratio *= 5;
  HammerTestOptions o{.blows = 2, .rate = 4096, .bits = 0, .converter_noise = 0};
  const std::vector<Recording> blows = simulate_hammer_test(p, o);
  ASSERT_EQ(blows.size(), 2u);
  for (const Recording& r : blows) {
    EXPECT_NO_THROW(r.check());
    for (double f : {6.0, 11.0, 12.5, 30.0, 46.0, 100.0, 128.0}) {
      const std::complex<double> h = line(r["acc_x"], r.dt, f) / line(r["force"], r.dt, f);
      const std::complex<double> expected = accelerance(p, f, 15 * 1.1, 8500 * 1.02);
      EXPECT_NEAR(std::abs(h - expected) / std::abs(expected), 0, 0.01) << f;
    }
    EXPECT_EQ(r["acc_y"].cwiseAbs().maxCoeff(), 0);  // no coupling left
  }
  EXPECT_NE(blows[0]["force"].maxCoeff(), blows[1]["force"].maxCoeff());
}

TEST(HammerTestProperty, BlowsStayInRangeAndCoupleTheAxes) {
  const std::vector<Recording> blows = simulate_hammer_test({}, {.blows = 3});
  for (const Recording& r : blows) {
    EXPECT_EQ(r.size(), 8 * 2048);
    EXPECT_GT(r["force"].maxCoeff(), 35);
    EXPECT_LT(r["force"].maxCoeff(), 151);
    EXPECT_LT(r["force"].head(100).cwiseAbs().maxCoeff(), 0.1);
    // Cross stiffness and the cubic: y moves although x was hit.
    EXPECT_GT(r["acc_y"].cwiseAbs().maxCoeff(), 0.1);
  }
  EXPECT_EQ(simulate_hammer_test({}, {.blows = 1})[0]["acc_x"], blows[0]["acc_x"]);
}

}  // namespace
}  // namespace whirl::rig
