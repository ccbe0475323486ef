#include "whirl/signal/angle.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::signal {
namespace {

constexpr double kDt = 1e-3;

// Run-down from 30 Hz to rest in 12 s.
AngleSignal run_down() { return angle_from_profile(0.4, 30 * kTwoPi, -30 * kTwoPi / 12, kDt, 12000); }

Eigen::VectorXd at_samples(const Eigen::VectorXd& half_grid) {
  return half_grid(Eigen::seq(0, half_grid.size() - 1, 2));
}

double rms(const Eigen::VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); }

// A filter or a resampling puts a reading in the middle of a wrap: anywhere between a full turn and zero.
TEST(AngleProperty, AReadingInTheMiddleOfAWrapIsNone) {
  const AngleSignal truth = run_down();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  Eigen::VectorXd readings = at_samples(truth.beta);
  for (double& v : readings) v -= kTwoPi * std::floor(v / kTwoPi);
  int smeared = 0;
  for (Eigen::Index i = 1; i + 1 < readings.size(); ++i) {
    if (readings[i] - readings[i - 1] > -std::numbers::pi) continue;
    const double part = share(random);
    readings[i] = part * readings[i - 1] + (1 - part) * readings[i];
    ++smeared, ++i;
  }
  ASSERT_GT(smeared, 100);
  const Eigen::VectorXd out = unwrapped(readings);
  Eigen::VectorXd error = out - at_samples(truth.beta);
  error.array() -= error[0];
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.35) << "one and a half steps of 0.19 rad, and 0.05";
  EXPECT_LT(rms(angle_from_encoder(readings, kDt).angle.beta - truth.beta), 0.01);
}

TEST(AngleReference, QuantisedAndWrappedEncoderOfARunDown) {
  const AngleSignal truth = run_down();
  for (const int counts : {256, 1024, 4096}) {
    const double step = kTwoPi / counts;
    Eigen::VectorXd readings = at_samples(truth.beta);
    for (double& v : readings) {
      v = step * std::floor(v / step);
      v -= kTwoPi * std::floor(v / kTwoPi);
    }
    AngleFitOptions options;
    options.count_offset = 0.5;
    const AngleFit fit = angle_from_encoder(readings, kDt, options);
    EXPECT_NEAR(fit.resolution, step, 1e-9);
    Eigen::VectorXd error = fit.angle.beta - truth.beta;
    error.array() -= kTwoPi * std::round(error.mean() / kTwoPi);
    EXPECT_LT(rms(error), 0.05 * step) << counts;
    EXPECT_LT(rms(fit.angle.omega - truth.omega), 2e-3) << counts;
    EXPECT_LT(fit.parameters, 8) << counts;
  }
}

TEST(AngleReference, ExactSweepIsNotTakenForACounter) {
  const AngleSignal truth = run_down();
  const AngleFit fit = angle_from_encoder(at_samples(truth.beta), kDt);
  EXPECT_EQ(fit.resolution, 0);
  EXPECT_LT(rms(fit.angle.beta - truth.beta), 1e-8);
  EXPECT_EQ(fit.parameters, 3);
}

TEST(AngleReference, EncoderOfACoastDownWithSpeedRipple) {
  // Speed with drag and 0.4 % ripple at 1 Hz: no polynomial fits.
  const Eigen::Index n = 14000;
  Eigen::VectorXd beta(n), omega(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = kDt * static_cast<double>(i), a = 190, r = 0.2, p = 6.5;
    beta[i] = a / r * (1 - std::exp(-r * t)) + 0.75 * std::sin(p * t) / p;
    omega[i] = a * std::exp(-r * t) + 0.75 * std::cos(p * t);
  }
  const double step = kTwoPi / 1024;
  Eigen::VectorXd readings = beta;
  for (double& v : readings) v = step * std::round(v / step);
  const AngleFit fit = angle_from_encoder(readings, kDt);
  EXPECT_LT(rms(at_samples(fit.angle.beta) - beta), 0.1 * step);
  EXPECT_LT(rms(at_samples(fit.angle.omega) - omega), 0.05);
  EXPECT_TRUE(fit.summary.warnings.empty());
}

TEST(AngleProperty, RateAndAccelerationAreTheDerivativesOfTheAngle) {
  Eigen::VectorXd beta(8000);
  for (Eigen::Index i = 0; i < beta.size(); ++i) {
    const double t = kDt * static_cast<double>(i);
    beta[i] = 60 * t + 3 * std::sin(2 * t);
  }
  const AngleSignal a = angle_from_encoder(beta, kDt).angle;
  const double h = 0.5 * kDt;
  for (Eigen::Index i = 1; i + 1 < a.beta.size(); i += 101) {
    EXPECT_NEAR((a.beta[i + 1] - a.beta[i - 1]) / (2 * h), a.omega[i], 1e-4);
    EXPECT_NEAR((a.omega[i + 1] - a.omega[i - 1]) / (2 * h), a.alpha[i], 1e-3);
  }
  EXPECT_LT((at_samples(a.beta) - beta).cwiseAbs().maxCoeff(), 1e-6);
}

std::vector<double> run_down_pulses(double jitter, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> times;
  const double w = 30 * kTwoPi, a = w / 12;
  for (int k = 0;; ++k) {
    const double root = w * w - 2 * a * kTwoPi * k;
    if (root < 0) return times;
    times.push_back((w - std::sqrt(root)) / a + jitter * normal(random));
  }
}

TEST(AngleReference, OncePerTurnPulsesWithTenMicrosecondsOfJitter) {
  const AngleSignal truth = angle_from_profile(0, 30 * kTwoPi, -30 * kTwoPi / 12, kDt, 12000);
  const AngleFit fit = angle_from_pulses(run_down_pulses(1e-5, 5), kDt, 12000);
  EXPECT_LT(rms(fit.angle.beta - truth.beta), 2e-3);
  EXPECT_LT(rms(fit.angle.omega - truth.omega), 5e-3);
}

TEST(AngleReference, MissingAndExtraPulsesAreRepaired) {
  std::vector<double> times = run_down_pulses(1e-5, 6);
  times.erase(times.begin() + 40);
  times.insert(times.begin() + 90, times[89] + 0.3 * (times[90] - times[89]));
  const AngleFit fit = angle_from_pulses(times, kDt, 12000);
  EXPECT_EQ(fit.missing, 1);
  EXPECT_EQ(fit.extra, 1);
  const AngleSignal truth = angle_from_profile(0, 30 * kTwoPi, -30 * kTwoPi / 12, kDt, 12000);
  EXPECT_LT(rms(fit.angle.beta - truth.beta), 2e-3);
}

/// A rotor whose speed follows a random course, integrated in steps of 20 us: its true angle at the samples and the
/// instants at which a mark on the shaft passes the probe.
struct MarkedShaft {
  double dt = 0;
  Eigen::VectorXd beta;        // rad, 0 at the first pulse
  std::vector<double> pulses;  // s

  explicit MarkedShaft(std::mt19937_64& random) {
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    dt = 1 / between(800, 4000);
    const double slow = between(0, 4), fast = between(15, 60), seconds = between(4, 20);
    const double bend = between(0.5, 2), ripple = between(0, 0.003), ripple_hz = between(1, 6);
    const bool down = random() % 2 == 0;
    const auto hz = [&](double t) {
      const double share = std::clamp(down ? 1 - t / seconds : t / seconds, 0.0, 1.0);
      return (slow + (fast - slow) * std::pow(share, bend)) * (1 + ripple * std::sin(ripple_hz * kTwoPi * t));
    };
    beta.resize(static_cast<Eigen::Index>(seconds / dt));
    constexpr double kStep = 2e-5;
    double turn = between(-1, 0), t = 0;
    double first = 0;
    for (Eigen::Index i = 0; i < beta.size(); ++i) {
      const double at = dt * static_cast<double>(i);
      for (; t < at; t += kStep) {
        const double next = turn + kStep * hz(t + 0.5 * kStep);
        if (std::floor(next) > std::floor(turn)) {
          pulses.push_back(t + kStep * (std::floor(next) - turn) / (next - turn));
          if (pulses.size() == 1) first = std::floor(next);
        }
        turn = next;
      }
      beta[i] = turn;
    }
    beta = kTwoPi * (beta.array() - first);
  }
};

TEST(AngleProperty, PulsesOfAnyRunUpOrRunDownAreCounted) {
  std::mt19937_64 random(4711);
  const auto chance = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  for (int k = 0; k < 60; ++k) {
    const MarkedShaft shaft(random);
    const bool damaged = k % 2 == 1;
    std::vector<double> seen;
    long missing = 0, extra = 0;
    for (std::size_t p = 0; p < shaft.pulses.size(); ++p) {
      const bool inside = p > 8 && p + 8 < shaft.pulses.size();
      if (damaged && inside && chance() < 0.02) {
        ++missing;
        continue;
      }
      seen.push_back(shaft.pulses[p] + 2e-5 * (chance() - 0.5));
      if (!damaged || !inside || chance() >= 0.01) continue;
      seen.push_back(shaft.pulses[p] + (0.2 + 0.3 * chance()) * (shaft.pulses[p + 1] - shaft.pulses[p]));
      ++extra;
    }
    const AngleFit fit = angle_from_pulses(seen, shaft.dt, shaft.beta.size());
    EXPECT_EQ(fit.missing, missing) << k;
    EXPECT_EQ(fit.extra, extra) << k;
    // Between the pulses; the ends are the fit's own.
    const auto first = static_cast<Eigen::Index>(seen[2] / shaft.dt);
    const auto last = static_cast<Eigen::Index>(seen[seen.size() - 3] / shaft.dt);
    const Eigen::VectorXd error = at_samples(fit.angle.beta) - shaft.beta;
    EXPECT_LT(rms(error.segment(first, last - first)), 0.03) << k;
  }
}

TEST(AngleReference, EdgesAreInterpolatedBetweenSamples) {
  Eigen::VectorXd signal = Eigen::VectorXd::Zero(1000);
  for (Eigen::Index k = 0; k < 9; ++k) {  // rises from 0 to 5 over two samples, crossing the middle at 100.6 + 100 k
    signal[100 * (k + 1)] = 1.0;
    signal[100 * (k + 1) + 1] = 3.5;
    signal.segment(100 * (k + 1) + 2, 5).setConstant(5);
  }
  const std::vector<double> times = pulse_times(signal, kDt);
  ASSERT_EQ(times.size(), 9U);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(times[k], 0.1006 + 0.1 * static_cast<double>(k), 1e-9);
}

TEST(AngleReference, ASparkIsNoPulse) {
  Eigen::VectorXd signal = Eigen::VectorXd::Zero(1000);
  for (Eigen::Index k = 0; k < 9; ++k) signal.segment(100 * (k + 1), 3).setConstant(5);
  signal[40] = -60;
  signal[733] = 80;
  const std::vector<double> times = pulse_times(signal, kDt);  // the spark is one more edge, which the count leaves out
  ASSERT_EQ(times.size(), 10U);
  const AngleFit fit = angle_from_pulses(times, kDt, 1000);
  EXPECT_EQ(fit.extra, 1);
  EXPECT_NEAR(fit.angle.omega[1000], kTwoPi / 0.1, 1e-3);
}

TEST(Angle, RefusesWhatCannotBeAnAngle) {
  EXPECT_THROW(angle_from_encoder(Eigen::VectorXd::Zero(10), kDt), Error);
  EXPECT_THROW(angle_from_encoder(Eigen::VectorXd::Constant(100, NAN), kDt), Error);
  EXPECT_THROW(angle_from_pulses({0, 1, 2}, kDt, 100), Error);
  EXPECT_THROW(angle_from_pulses({0, 1, 2, 1.5, 3, 4, 5}, kDt, 100), Error);
}

}  // namespace
}  // namespace whirl::signal
