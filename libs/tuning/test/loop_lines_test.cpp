// What is read of loops on lines: closed forms, narrow resonances, noise, and how margins of one loop bind each other.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>

#include "response_estimate.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {
namespace {

// L = g e^{-i omega tau} / (i omega): gain margin pi / (2 tau g), delay margin pi / (2 g) - tau, both whirl directions
// alike.
TEST(LoopMarginsReference, IntegratorWithDelay) {
  LoopResponse r;
  const double g = 40, tau = 8e-3;
  for (double f = -400; f <= 400; f += 0.05) {
    if (std::abs(f) < 0.01) continue;
    const std::complex<double> s(0, kTwoPi * f);
    r.frequency.push_back(f);
    r.loop.push_back(g * std::exp(-s * tau) / s);
  }
  const LoopMargins m = margins_of(r);
  EXPECT_NEAR(m.gain_up, std::numbers::pi / (2 * tau * g), 1e-2);
  EXPECT_NEAR(m.delay, std::numbers::pi / (2 * g) - tau, 1e-4);
  EXPECT_NEAR(m.phase, std::numbers::pi / 2 - tau * g, 1e-3);
  EXPECT_NEAR(m.modulus * m.peak_sensitivity, 1, 1e-12);
  EXPECT_EQ(m.gain_down, 0);
}

// A resonance narrower than the lines: what is read of it agrees with the same loop on lines fifty times as fine, and
// the margins hold together wherever the lines fall.
TEST(LoopMarginsProperty, NarrowResonancesAreReadBetweenTheLines) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  for (int n = 0; n < 200; ++n) {
    const double f0 = uniform(20, 60), zeta = uniform(0.001, 0.01), part = uniform(-3, 3) * zeta, g = uniform(5, 40),
                 tau = uniform(1e-3, 4e-3);
    const auto response = [&](double spacing) {
      LoopResponse r;
      for (double f = 1; f < 100; f += spacing) {
        const std::complex<double> s(0, kTwoPi * f), w(kTwoPi * f0);
        r.frequency.push_back(f);
        r.loop.push_back((g / s + part * w * w / (s * s + 2 * zeta * w * s + w * w)) * std::exp(-s * tau));
      }
      return r;
    };
    const LoopMargins coarse = margins_of(response(0.25)), fine = margins_of(response(0.005));
    EXPECT_LE(coarse.modulus, std::abs(1 - 1 / coarse.gain_up) * (1 + 1e-9));
    if (coarse.gain_down > 0) {
      EXPECT_LE(coarse.modulus, std::abs(1 - 1 / coarse.gain_down) * (1 + 1e-9));
    }
    EXPECT_LE(coarse.modulus, 2 * std::sin(0.5 * coarse.phase) * (1 + 1e-9));
    EXPECT_NEAR(coarse.modulus, fine.modulus, 0.1 * fine.modulus + 0.01) << n << ": " << f0 << " Hz, zeta " << zeta;
    if (std::isfinite(fine.gain_up) && fine.gain_up < 8) {
      EXPECT_NEAR(coarse.gain_up, fine.gain_up, 0.1 * fine.gain_up + 0.02) << n;
    }
  }
}

// A loop of small gain measured with noise: between its lines it reads no peak that none of the lines shows.
TEST(LoopMarginsProperty, NoiseOfMeasuredLinesIsNoPeak) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise(0, 0.08);
  for (int n = 0; n < 50; ++n) {
    LoopResponse r;
    double highest = 0;
    for (double f = 100; f < 400; f *= 1.02) {
      r.frequency.push_back(f);
      r.loop.push_back(std::polar(0.25, -kTwoPi * f * 2e-3) + std::complex<double>(noise(random), noise(random)));
      highest = std::max(highest, 1 / std::abs(1.0 + r.loop.back()));
    }
    EXPECT_LT(margins_of(r).peak_sensitivity, 1.1 * highest) << n;
  }
}

/// Spectrum of white noise with a variance of `size` squared.
Eigen::VectorXcd white(Eigen::Index n, double size, std::mt19937_64& random) {
  std::normal_distribution<double> one(0, size / std::numbers::sqrt2);
  Eigen::VectorXcd out(n);
  for (std::complex<double>& v : out) v = {one(random), one(random)};
  return out;
}

// A smooth loop and a narrow resonance seen through noise: the estimate lies within its stated deviation, better than
// the lines where the loop is smooth, and the resonance keeps its height.
TEST(ResponseEstimateProperty, NoiseIsSmoothedAwayAndANarrowResonanceIsNot) {
  constexpr Eigen::Index kLines = 2000;
  constexpr double kStep = 1e-3, kNoise = 0.05;
  std::mt19937_64 random(3);
  const auto loop_at = [](double f) {
    const std::complex<double> s(0, kTwoPi * f), w(0, kTwoPi * 60);
    return 60.0 / (s + 40.0) * std::exp(-2e-3 * s) + 1.5 * 4.0 / (s - w + 4.0);
  };
  Eigen::VectorXcd exact(kLines);
  for (Eigen::Index k = 0; k < kLines; ++k) {
    exact[k] = 1.0 / (1.0 + loop_at(static_cast<double>(k < kLines / 2 ? k : k - kLines) / (kLines * kStep)));
  }
  ResponseEstimate estimate(kLines);
  for (int n = 0; n < 8; ++n) {
    const Eigen::VectorXcd excitation = white(kLines, 1, random);
    // The answer is that of the law and noise as large as a twentieth of each line.
    Eigen::VectorXcd answer = ((exact.array() - 1.0) * excitation.array()).matrix();
    answer.array() += kNoise * (white(kLines, 1, random).array() * excitation.array().abs());
    estimate.add(answer, excitation);
  }
  const LoopResponse r = estimate.response(kStep);
  double smooth = 0, normalised = 0, highest = 0, truth = 0;
  int count = 0;
  for (std::size_t i = 0; i < r.loop.size(); ++i) {
    const double f = r.frequency[i];
    const std::complex<double> l = loop_at(f), error = r.loop[i] - l;
    truth = std::max(truth, 1 / std::abs(1.0 + l));
    highest = std::max(highest, 1 / std::abs(1.0 + r.loop[i]));
    if (std::abs(f) < 100 || std::abs(f) > 400) continue;
    smooth += std::norm(error);
    normalised += std::norm(error) / (2 * r.deviation[i] * r.deviation[i]);
    ++count;
  }
  const double line = kNoise / std::sqrt(8.0);
  EXPECT_LT(std::sqrt(smooth / count), 0.4 * line);
  EXPECT_NEAR(normalised / count, 1, 0.4);
  EXPECT_NEAR(highest, truth, 0.05 * truth);
  EXPECT_TRUE(peak_is_certain(r));
}

// Gain, phase and modulus of one loop bind each other; a gain that the running loop showed binds the modulus too.
TEST(LoopMarginsProperty, MarginsHoldTogether) {
  LoopMargins m;
  m.gain_up = 1.2, m.gain_down = 0.5, m.phase = 1, m.modulus = 0.6, m.peak_sensitivity = 1 / 0.6;
  hold_together(m);
  EXPECT_NEAR(m.modulus, 1 - 1 / 1.2, 1e-12);
  EXPECT_NEAR(m.peak_sensitivity * m.modulus, 1, 1e-12);
  const VerdictLimits limits;
  const std::optional<Finding> missed = missed_margin(m, 1e-3);
  ASSERT_TRUE(missed);
  EXPECT_EQ(missed->amount("value"), 1.2);
  EXPECT_NEAR(missed->amount("least"), 4.0 / 3, 1e-12);
  // The limits are those of one loop: who keeps the peak sensitivity keeps all of them.
  EXPECT_NEAR(1 - 1 / limits.gain_up(), limits.modulus(), 1e-12);
  EXPECT_NEAR(1 / limits.gain_down() - 1, limits.modulus(), 1e-12);
  EXPECT_NEAR(2 * std::sin(limits.phase() / 2), limits.modulus(), 1e-12);
  m = {};
  m.gain_up = 2, m.gain_down = 0, m.delay = 1e-2, m.phase = 0.2, m.peak_sensitivity = 5, m.modulus = 0.2;
  ASSERT_TRUE(missed_margin(m, 1e-3));
  EXPECT_EQ(missed_margin(m, 1e-3)->where, "phase margin");
  m.phase = 0.5;
  EXPECT_EQ(missed_margin(m, 1e-3)->where, "peak sensitivity");
  m.peak_sensitivity = 3.9;
  EXPECT_FALSE(missed_margin(m, 1e-3));
}

}  // namespace
}  // namespace whirl::tuning
