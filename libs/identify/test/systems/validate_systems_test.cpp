// What `validate` says of general systems over a whole record.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"

namespace whirl::identification {
namespace {

using testing::DrivenOscillator;

Identification found(const Recording& record) {
  IdentifyOptions options;
  options.method = Method::sindy;
  options.sindy.states = {"x", "v"};
  options.sindy.inputs = {"u"};
  options.holdout = 0;
  return identify(record, options);
}

DrivenOscillator lightly_damped(unsigned seed) {
  DrivenOscillator o = testing::drawn_oscillator(seed);
  o.damping = 0.02 * std::sqrt(o.stiffness);
  o.cubic = 0.05 * o.stiffness;
  return o;
}

TEST(ValidateSystemsProperty, ARightModelIsOk) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const DrivenOscillator machine = seed % 2 == 0 ? testing::drawn_oscillator(seed) : lightly_damped(seed);
    const Identification id = found(driven_record(machine, {.seed = seed}));
    const ValidationReport report =
        validate(id.model, std::vector<Recording>{driven_record(machine, {.seed = seed + 200, .seconds = 60})});
    EXPECT_EQ(report.summary.status, Status::ok)
        << seed << " " << (report.summary.warnings.empty() ? "" : report.summary.warnings.back());
    ASSERT_EQ(report.runs[0].band_whole.size(), 2u);
  }
}

TEST(ValidateSystemsProperty, AWrongDampingIsSeenOverTheWholeRun) {
  for (unsigned seed = 11; seed <= 16; ++seed) {
    const DrivenOscillator machine = lightly_damped(seed);
    Identification id = found(driven_record(machine, {.seed = seed}));
    for (EquationTerm& t : id.model.equations[1].terms) {
      if (t.function == "v") t.coefficient.value *= 1.25;
    }
    const ValidationReport report =
        validate(id.model, std::vector<Recording>{driven_record(machine, {.seed = seed + 200, .seconds = 60})});
    EXPECT_NE(report.summary.status, Status::ok) << seed;
  }
}

// A model that does not explain its own records is not called right for being as wrong on others.
TEST(ValidateSystemsProperty, AModelsOwnErrorIsNoExcuse) {
  for (unsigned seed = 21; seed <= 24; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    IdentifyOptions options;
    options.method = Method::sindy;
    options.sindy.states = {"x", "v"};
    options.sindy.inputs = {"u"};
    options.sindy.library = {"1", "x", "v", "u"};  // no cubic spring
    options.holdout = 0;
    const Identification id = identify(driven_record(machine, {.seed = seed, .noise = 0.01}), options);
    if (!id.usable()) continue;
    const ValidationReport report =
        validate(id.model, std::vector<Recording>{driven_record(machine, {.seed = seed + 200, .noise = 0.01})});
    EXPECT_NE(report.summary.status, Status::ok) << seed;
  }
}

// Chaos: the free run leaves the record, and says nothing.
TEST(ValidateSystemsProperty, ChaosIsNoError) {
  const auto lorenz = [](unsigned seed, int samples) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss;
    std::array<double, 3> s{gauss(random), gauss(random), 25 + gauss(random)};
    const auto rate = [](const std::array<double, 3>& q) {
      return std::array<double, 3>{10 * (q[1] - q[0]), q[0] * (28 - q[2]) - q[1], q[0] * q[1] - 8.0 / 3 * q[2]};
    };
    Eigen::MatrixXd x(samples, 3);
    for (int i = -500; i < samples; ++i) {
      for (int k = 0; k < 3 && i >= 0; ++k) x(i, k) = s[static_cast<std::size_t>(k)] + 0.08 * gauss(random);
      for (int j = 0; j < 40; ++j) {
        const double h = 0.01 / 40;
        std::array<double, 3> a = rate(s), middle = s;
        for (std::size_t k = 0; k < 3; ++k) middle[k] += h / 2 * a[k];
        a = rate(middle);
        for (std::size_t k = 0; k < 3; ++k) s[k] += h * a[k];
      }
    }
    Recording r;
    r.dt = 0.01;
    r.add("x", Quantity::dimensionless, x.col(0));
    r.add("y", Quantity::dimensionless, x.col(1));
    r.add("z", Quantity::dimensionless, x.col(2));
    return r;
  };
  IdentifyOptions options;
  options.method = Method::sindy;
  options.holdout = 0;
  const Identification id = identify(lorenz(1, 2500), options);
  ASSERT_EQ(id.summary.status, Status::ok);
  const ValidationReport report = validate(id.model, std::vector<Recording>{lorenz(2, 3000)});
  EXPECT_EQ(report.summary.status, Status::ok);
  EXPECT_TRUE(std::isnan(report.runs[0].band_whole[0]));
  EXPECT_GT(report.runs[0].general.scores[0].nrmse, 0.5);
}

}  // namespace
}  // namespace whirl::identification
