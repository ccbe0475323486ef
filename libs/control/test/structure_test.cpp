#include "whirl/control/structure.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/control/controller.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

constexpr double kStructureTick = 1e-3, kSplit = 0.37;

/// One oscillator q'' + 2 z w q' + w^2 q = s a(t), fourth-order steps of 1/400 of a piece.
struct Oscillator {
  double w, z, share;
  std::complex<double> q, v;
  void run(std::complex<double> a, double time) {
    const int steps = 400;
    const double h = time / steps;
    const auto rate = [&](std::complex<double> x, std::complex<double> y) {
      return share * a - 2 * z * w * y - w * w * x;
    };
    for (int i = 0; i < steps; ++i) {
      const auto k1 = rate(q, v), v2 = v + 0.5 * h * k1, k2 = rate(q + 0.5 * h * v, v2), v3 = v + 0.5 * h * k2,
                 k3 = rate(q + 0.5 * h * v2, v3), v4 = v + h * k3, k4 = rate(q + h * v3, v4);
      q += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
  }
};

TEST(StructureReference, EqualsTheOscillatorsIntegratedApart) {
  std::array<StructureMode, Structure::kModes> modes{
      {{289, 0.008, -0.3}, {0, 0, 1}, {804, 0.006, 0.015}, {1948, 0.3, 2}}};
  Structure structure(modes, kStructureTick, kSplit);
  ASSERT_FALSE(structure.empty());
  std::vector<Oscillator> apart{{289, 0.008, -0.3, 0, 0}, {804, 0.006, 0.015, 0, 0}, {1948, 0.3, 2, 0, 0}};
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  double worst = 0, largest = 0;
  for (int k = 0; k < 300; ++k) {
    const std::complex<double> first{normal(random), normal(random)}, second{normal(random), normal(random)};
    std::complex<double> sum;
    for (Oscillator& o : apart) {
      o.run(first, kSplit * kStructureTick);
      o.run(second, (1 - kSplit) * kStructureTick);
      sum += o.q;
    }
    worst = std::max(worst, std::abs(structure.step(first, second) - sum));
    largest = std::max(largest, std::abs(sum));
  }
  EXPECT_LT(worst, 1e-9 * largest);
  structure.reset();
  EXPECT_EQ(structure.step(0, 0), std::complex<double>());
  EXPECT_TRUE(Structure({}, kStructureTick, 0).empty());
}

// What the actuators make the structure show is no motion of the disk: the controller's reading is that of the disk
// alone, for a loop delay that is no whole number of samples.
TEST(StructureProperty, ReadingsAreThoseOfTheDisk) {
  ControllerDesign d = testing::design_of("pd", "lpf");
  d.parameters["mode_1_omega"] = 289;
  d.parameters["mode_1_damping"] = 0.008;
  d.parameters["mode_1_share"] = -0.3;
  Controller c = make_controller(d);
  const int whole = static_cast<int>(d.delay / kStructureTick);
  const double split = d.delay / kStructureTick - whole;
  Oscillator mode{289, 0.008, -0.3, 0, 0};
  std::vector<std::complex<double>> sent(static_cast<std::size_t>(whole) + 2);  // the oldest first
  double worst = 0, shown = 0;
  for (int k = 0; k < 2000; ++k) {
    mode.run(sent[0], split * kStructureTick);
    mode.run(sent[1], (1 - split) * kStructureTick);
    const std::complex<double> disk = 2e-4 * std::polar(1.0, 0.06 * k), z = disk + mode.q;
    const auto u = c.step({.t = kStructureTick * k, .x = z.real(), .y = z.imag(), .beta = 0.06 * k, .omega = 60});
    ASSERT_TRUE(u);
    worst = std::max(worst, std::abs(c.state().measured - disk));
    shown = std::max(shown, std::abs(mode.q));
    sent.erase(sent.begin());
    sent.push_back(d.model.gain * std::complex<double>(u->ux, u->uy));
  }
  EXPECT_GT(shown, 1e-6);
  EXPECT_LT(worst, 1e-6 * shown);
}

}  // namespace
}  // namespace whirl::control
