#include "whirl/modal/transient_runup.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::modal {
namespace {

constexpr double kRpm = 2 * std::numbers::pi / 60;
using Complex = std::complex<double>;

RunupResponse measured(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<std::array<double, 3>> rows;
  while (std::getline(file, line)) {
    std::array<double, 3> v{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &v[0], &v[1], &v[2]) == 3) rows.push_back(v);
  }
  RunupResponse run;
  const auto n = static_cast<Eigen::Index>(rows.size());
  run.omega.resize(n);
  run.vector.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto& [rpm, amplitude, phase] = rows[static_cast<std::size_t>(k)];
    run.omega[k] = rpm * kRpm;
    run.vector[k] = std::polar(amplitude * 1e-6, phase * std::numbers::pi / 180);
  }
  return run;
}

TEST(TransientRunupReference, MeasuredRunThroughTheCriticalSpeed) {
  const auto path = testing::data_file("rk4_runup/runup_bode_1037_2110rpm.csv");
  WHIRL_REQUIRE_DATA(path);
  const RunupResponse run = measured(path);
  ASSERT_EQ(run.omega.size(), 124);
  const auto fit = [&](RunupModel model, int modes) {
    TransientRunupOptions o;
    o.model = model;
    o.modes = modes;
    return fit_transient_runup(run, o);
  };
  const TransientRunupFit steady = fit(RunupModel::steady, 2);
  const TransientRunupFit transient = fit(RunupModel::transient, 2);
  // Reference values: steady, one mode 74.8 % at 1655 rpm, two 78.7 %; transient, one mode 68.7 % at 1587 rpm, two 86.2
  // % at 1575 rpm (zeta 0.012) and 1659 rpm (zeta 0.029).
  EXPECT_NEAR(fit(RunupModel::steady, 1).fit_percent, 74.8, 0.5);
  EXPECT_NEAR(fit(RunupModel::transient, 1).fit_percent, 68.7, 0.5);
  EXPECT_NEAR(steady.fit_percent, 78.7, 0.5);
  EXPECT_GE(transient.fit_percent, 85);
  EXPECT_LT(transient.fit_percent, kRunupExplained);
  EXPECT_NE(transient.summary.status, Status::ok) << "its standard deviations are those of the noise alone";
  EXPECT_GE(transient.fit_percent, steady.fit_percent + 7);
  EXPECT_NEAR(transient.peak_speed / kRpm, 1665, 10);
  EXPECT_NEAR(transient.peak_speed_measured / kRpm, 1665, 10);
  EXPECT_NEAR(transient.modes[0].omega.value / kRpm, 1575, 5);
  EXPECT_NEAR(transient.modes[1].omega.value / kRpm, 1659, 5);
  EXPECT_NEAR(transient.modes[0].zeta.value, 0.012, 0.002);
  EXPECT_NEAR(transient.modes[1].zeta.value, 0.029, 0.002);
  EXPECT_NEAR(transient.alpha, 23.9, 0.1);
  EXPECT_NEAR(transient.amplification, 18.7, 0.3);
  const double beats[] = {1770, 1837, 1889, 1926};
  ASSERT_GE(transient.beats.size(), 4U);
  ASSERT_GE(transient.beats_measured.size(), 4U);
  EXPECT_TRUE(steady.beats.empty());
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(transient.beats[k] / kRpm, beats[k], 12);
    EXPECT_NEAR(transient.beats_measured[k] / kRpm, beats[k], 4);
  }
}

/// Envelope of one or two modes along a linear sweep, integrated in the rotating frame with small steps.
RunupResponse synthetic(const std::vector<RunupMode>& modes, Complex runout, double omega0, double alpha, double end) {
  RunupResponse run;
  std::vector<double> speed, time;
  std::vector<Complex> vector;
  std::vector<Eigen::Vector2cd> q;
  for (const RunupMode& m : modes) {
    const double w = m.omega.value;
    q.emplace_back(omega0 * omega0 / Complex(w * w - omega0 * omega0, 2 * m.zeta.value * w * omega0), 0);
  }
  constexpr double kStep = 2e-5;
  double next_turn = 0;
  for (double t = 0; t < end; t += kStep) {
    const double s = omega0 + alpha * t, beta = t * (omega0 + 0.5 * alpha * t);
    if (beta >= next_turn) {
      next_turn += 2 * std::numbers::pi;
      Complex z = runout;
      for (std::size_t k = 0; k < modes.size(); ++k) z += modes[k].participation * q[k][0];
      speed.push_back(s);
      time.push_back(t);
      vector.push_back(z);
    }
    for (std::size_t k = 0; k < modes.size(); ++k) {
      const double w = modes[k].omega.value, zeta = modes[k].zeta.value;
      q[k] = rk4_step(
          [&](double at, const Eigen::Vector2cd& v) {
            const double u = omega0 + alpha * at;
            return Eigen::Vector2cd(v[1], Complex(u * u, -alpha) - Complex(2 * zeta * w, 2 * u) * v[1] -
                                              Complex(w * w - u * u, alpha + 2 * zeta * w * u) * v[0]);
          },
          t, q[k], kStep);
    }
  }
  const auto n = static_cast<Eigen::Index>(speed.size());
  run.omega = Eigen::Map<Eigen::VectorXd>(speed.data(), n);
  run.time = Eigen::Map<Eigen::VectorXd>(time.data(), n);
  run.vector = Eigen::Map<Eigen::VectorXcd>(vector.data(), n);
  return run;
}

RunupMode mode(double rpm, double zeta, Complex participation) {
  return {Estimate::from_sd(rpm * kRpm, 0), Estimate::from_sd(zeta, 0), participation};
}

TEST(TransientRunupReference, RecoversTwoCloseModesOfAFastRun) {
  const std::vector<RunupMode> truth = {mode(1570, 0.015, 4e-7), mode(1655, 0.03, {3e-7, 3e-7})};
  RunupResponse run = synthetic(truth, {1e-6, -5e-7}, 1037 * kRpm, 24, 4.7);
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0, 5e-8);
  for (Complex& z : run.vector) {
    const double a = normal(random), b = normal(random);
    z += Complex(a, b);
  }
  const TransientRunupFit fit = fit_transient_runup(run);
  EXPECT_EQ(fit.summary.status, Status::ok);
  EXPECT_GT(fit.fit_percent, 97);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_NEAR(fit.modes[k].omega.value, truth[k].omega.value,
                4 * fit.modes[k].omega.sd + 1e-4 * truth[k].omega.value);
    EXPECT_NEAR(fit.modes[k].zeta.value, truth[k].zeta.value, 4 * fit.modes[k].zeta.sd + 1e-3 * truth[k].zeta.value);
    EXPECT_LT(fit.modes[k].zeta.sd, 0.05 * truth[k].zeta.value);
  }
}

TEST(TransientRunupProperty, BeatsAreSpacedByFourPiAlpha) {
  const std::vector<RunupMode> truth = {mode(1600, 0.01, 1e-6)};
  TransientRunupOptions o;
  o.modes = 1;
  const TransientRunupFit fit = fit_transient_runup(synthetic(truth, 0, 1100 * kRpm, 24, 5), o);
  ASSERT_GE(fit.beats.size(), 5U);
  for (std::size_t k = 1; k < 5; ++k) {
    const double w = truth[0].omega.value;
    const double spacing = std::pow(fit.beats[k] - w, 2) - std::pow(fit.beats[k - 1] - w, 2);
    EXPECT_NEAR(spacing / (4 * std::numbers::pi * 24), 1, 0.06) << k;
  }
}

RunupResponse with_noise(RunupResponse run, double sd, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, sd);
  for (Complex& z : run.vector) {
    const double a = normal(random), b = normal(random);
    z += Complex(a, b);
  }
  return run;
}

// How much the modes explain says nothing alone: noise may leave as much as a wrong model.
TEST(TransientRunupProperty, NoiseIsNoModelErrorAndAWrongModelIsNoResult) {
  const std::vector<RunupMode> truth = {mode(1570, 0.02, 4e-7), mode(1655, 0.03, {3e-7, 3e-7})};
  const RunupResponse run = synthetic(truth, {1e-6, -5e-7}, 1037 * kRpm, 24, 4.7);
  // Noise of a third of the vectors: fewer percent are explained, and the intervals hold.
  const TransientRunupFit noisy = fit_transient_runup(with_noise(run, 2e-6, 3));
  EXPECT_LT(noisy.fit_percent, 90);
  EXPECT_EQ(noisy.summary.status, Status::ok) << noisy.fit_percent;
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_NEAR(noisy.modes[k].omega.value, truth[k].omega.value, 4 * noisy.modes[k].omega.sd);
  // Lags read as leads.
  RunupResponse lags = with_noise(run, 5e-8, 4);
  lags.vector = lags.vector.conjugate().eval();
  const TransientRunupFit wrong = fit_transient_runup(lags);
  EXPECT_LT(wrong.fit_percent, 60);
  EXPECT_EQ(wrong.summary.status, Status::unusable) << wrong.fit_percent;
  // No mode at all: what is explained is chance.
  RunupResponse none = run;
  none.vector.setConstant(Complex(1e-6, 2e-6));
  for (unsigned seed = 10; seed < 14; ++seed)
    EXPECT_EQ(fit_transient_runup(with_noise(none, 1e-6, seed), {.modes = 1}).summary.status, Status::unusable) << seed;
}

TEST(TransientRunup, ShortOrConstantRunsAreUnusable) {
  RunupResponse run = synthetic({mode(1600, 0.01, 1e-6)}, 0, 1100 * kRpm, 24, 0.4);
  EXPECT_EQ(fit_transient_runup(run).summary.status, Status::unusable);
  run = synthetic({mode(1600, 0.01, 1e-6)}, 0, 1100 * kRpm, 0.5, 4);
  EXPECT_EQ(fit_transient_runup(run).summary.status, Status::unusable);
}

TEST(TransientRunup, UnequalLengthsAreAnError) {
  RunupResponse run = synthetic({mode(1600, 0.01, 1e-6)}, 0, 1100 * kRpm, 24, 4);
  run.time.conservativeResize(5);
  EXPECT_THROW(fit_transient_runup(run), Error);
}

}  // namespace
}  // namespace whirl::modal
