// Records taken at few samples a turn, and strongly hardening rotors: what the integration and the linearised noise of
// the fit leave out must not show as a term of the machine.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification {
namespace {

using Complex = std::complex<double>;

/// A run-up or run-down of an isotropic cubic rotor in its class, by Stoermer's rule of order 2 with Richardson
/// extrapolation to order 6 over each sample (the fit integrates by Runge-Kutta).
struct Machine {
  double hz = 12, zeta = 0.01, eccentricity = 1e-4, phase = 0.7, k2 = 0;
  double from_hz = 1, to_hz = 30, seconds = 14, rate = 400;

  double k1() const { return std::pow(2 * std::numbers::pi * hz, 2); }
  double c() const { return 4 * std::numbers::pi * hz * zeta; }

  Complex acceleration(double t, Complex z, Complex v) const {
    const double w0 = 2 * std::numbers::pi * from_hz, a = 2 * std::numbers::pi * (to_hz - from_hz) / seconds;
    const double w = w0 + a * t, angle = w0 * t + 0.5 * a * t * t;
    const Complex force = eccentricity * Complex(w * w, -a) * std::polar(1.0, angle + phase);
    return force - c() * v - (k1() + k2 * std::norm(z)) * z;
  }

  /// Over one sample by `n` midpoint steps (Gragg).
  std::pair<Complex, Complex> across(double t, Complex z, Complex v, int n) const {
    const double h = 1 / (rate * n);
    Complex z0 = z, v0 = v, z1 = z + h * v, v1 = v + h * acceleration(t, z, v);
    for (int k = 1; k < n; ++k) {
      const Complex z2 = z0 + 2 * h * v1, v2 = v0 + 2 * h * acceleration(t + k * h, z1, v1);
      z0 = z1, v0 = v1, z1 = z2, v1 = v2;
    }
    const Complex end = acceleration(t + n * h, z1, v1);
    return {0.5 * (z1 + z0 + h * v1), 0.5 * (v1 + v0 + h * end)};
  }

  Recording record(double noise, std::uint64_t seed) const {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    const auto n = static_cast<Eigen::Index>(seconds * rate);
    Eigen::VectorXd x(n), y(n), beta(n);
    const double w0 = 2 * std::numbers::pi * from_hz, a = 2 * std::numbers::pi * (to_hz - from_hz) / seconds;
    Complex p = 0, v = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) / rate;
      x[i] = p.real();
      y[i] = p.imag();
      beta[i] = w0 * t + 0.5 * a * t * t;
      // Three midpoint results extrapolated in h^2.
      const auto coarse = across(t, p, v, 8), middle = across(t, p, v, 16), fine = across(t, p, v, 32);
      const auto best = [](Complex c, Complex m, Complex f) {
        const Complex a1 = (4.0 * m - c) / 3.0, a2 = (4.0 * f - m) / 3.0;
        return (16.0 * a2 - a1) / 15.0;
      };
      p = best(coarse.first, middle.first, fine.first);
      v = best(coarse.second, middle.second, fine.second);
    }
    const double sd = noise * std::sqrt((x.squaredNorm() + y.squaredNorm()) / static_cast<double>(2 * n));
    Recording r;
    r.dt = 1 / rate;
    r.source = "coarse";
    for (Eigen::Index i = 0; i < n; ++i) {
      x[i] += sd * normal(random);
      y[i] += sd * normal(random);
    }
    r.add("x", Quantity::displacement, x);
    r.add("y", Quantity::displacement, y);
    r.add("beta", Quantity::angle, beta);
    return r;
  }
};

/// Distance from the truth in stated standard deviations, beyond a share of the value that means nothing.
double off(const IdentifiedModel& m, const std::string& name, double truth) {
  const Estimate& e = *m.parameter(name);
  return std::max(0.0, std::abs(e.value - truth) - 1e-7 * std::abs(truth)) / e.sd;
}

TEST(CoarseSamplingProperty, FewSamplesATurnGiveNoFalseTermAndNoFalseValue) {
  int within = 0, all = 0;
  for (const double noise : {0.0, 1e-4, 1e-2}) {
    for (const double rate : {300.0, 400.0, 700.0}) {
      for (const bool up : {true, false}) {
        Machine machine{.zeta = up ? 0.02 : 0.008, .k2 = 1e7, .rate = rate};
        if (!up) std::swap(machine.from_hz, machine.to_hz);
        const IdentifiedModel m = identify_rotor(machine.record(noise, 7100 + static_cast<std::uint64_t>(all)));
        SCOPED_TRACE(::testing::Message() << "noise " << noise << ", " << rate << " Hz, " << (up ? "up" : "down"));
        ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
        EXPECT_TRUE(m.rotor->modes.empty());
        for (const char* term : {"c2", "k1_drift", "c_drift", "k4", "coulomb"}) EXPECT_EQ(m.parameter(term), nullptr);
        EXPECT_LT(off(m, "k1", machine.k1()), 4.5);
        EXPECT_LT(off(m, "k2", machine.k2), 4.5);
        EXPECT_LT(off(m, "c", machine.c()), 4.5);
        EXPECT_LT(off(m, "e", machine.eccentricity), 4.5);
        within += off(m, "k1", machine.k1()) < 2;
        ++all;
      }
    }
  }
  EXPECT_GE(within, 15) << "of " << all;
}

TEST(CoarseSamplingProperty, AStronglyHardeningRunUpIsNoModelError) {
  // The cubic force reaches that of the linear spring: noise turned by conj z counts as much as noise itself.
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Machine machine{.hz = 200,
                          .eccentricity = 2e-5,
                          .k2 = std::pow(400 * std::numbers::pi, 2) * (seed % 2 ? 2e6 : 5e5),
                          .from_hz = 50,
                          .to_hz = 300,
                          .seconds = 4,
                          .rate = 10000};
    const IdentifiedModel m = identify_rotor(machine.record(0.02, 7200 + seed));
    SCOPED_TRACE(seed);
    EXPECT_GT(m.summary.chi_square, 0.8);
    EXPECT_LT(m.summary.chi_square, 1.25);
    EXPECT_LT(off(m, "k1", machine.k1()), 4);
    EXPECT_LT(off(m, "k2", machine.k2), 4);
    EXPECT_LT(off(m, "c", machine.c()), 4);
  }
}

}  // namespace
}  // namespace whirl::identification
