#include "whirl/signal/spectrum.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/signal/resample.hpp"

namespace {
using whirl::AmplitudeKind;
using namespace std::complex_literals;

Eigen::VectorXd noise(Eigen::Index n, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); });
}

TEST(FftProperty, AgreesWithTheDefiningSumForEvenOddAndPrimeLengths) {
  for (Eigen::Index n : {1, 2, 7, 12, 31, 64}) {
    Eigen::VectorXcd x(n);
    x.real() = noise(n, 1);
    x.imag() = noise(n, 2);
    const Eigen::VectorXcd fast = whirl::signal::fft(x);
    for (Eigen::Index k = 0; k < n; ++k) {
      std::complex<double> sum = 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        sum += x[i] * std::exp(-2i * whirl::kPi * static_cast<double>(k * i) / static_cast<double>(n));
      }
      EXPECT_LT(std::abs(fast[k] - sum), 1e-12 * static_cast<double>(n));
    }
    EXPECT_LT((whirl::signal::inverse_fft(fast) - x).norm(), 1e-13 * static_cast<double>(n));
    const Eigen::VectorXd real = x.real();
    const Eigen::VectorXcd lines = whirl::signal::real_fft(real);
    EXPECT_LT((lines - whirl::signal::fft(real.cast<std::complex<double>>()).head(lines.size())).norm(),
              1e-13 * static_cast<double>(n));
  }
}

TEST(FftProperty, ManyThreadsMayTransformAtOnce) {
  std::vector<std::thread> threads;
  std::vector<double> errors(8, 1.0);
  for (unsigned t = 0; t < 8; ++t) {
    threads.emplace_back([t, &errors] {
      double worst = 0;
      for (Eigen::Index n = 100 + t; n < 400; n += 37) {
        const Eigen::VectorXcd x = noise(n, t).cast<std::complex<double>>();
        const Eigen::VectorXcd lines = whirl::signal::fft(x);
        worst = std::max(worst, (whirl::signal::inverse_fft(lines) - x).norm());
        worst = std::max(worst, (whirl::signal::real_fft(x.real()) - lines.head(n / 2 + 1)).norm());
        // Plans of its own, made and destroyed meanwhile.
        worst = std::max(worst, std::abs(whirl::signal::upsample(x.real(), 3)[3 * (n / 2)] - x[n / 2].real()));
      }
      errors[t] = worst;
    });
  }
  for (auto& thread : threads) thread.join();
  for (double e : errors) EXPECT_LT(e, 1e-11);
}

TEST(Fft, FastLengthsAreProductsOfTwoThreeAndFive) {
  EXPECT_EQ(whirl::signal::fast_fft_length(7), 8);
  EXPECT_EQ(whirl::signal::fast_fft_length(1001), 1024);
  EXPECT_EQ(whirl::signal::fast_fft_length(1), 1);
}

TEST(SpectrumReference, SineAmplitudeInEachKindAndWindow) {
  const Eigen::Index n = 1000;
  const double dt = 1e-3, amplitude = 2.5;
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i)
    x[i] = 0.7 + amplitude * std::cos(2 * whirl::kPi * 50 * static_cast<double>(i) * dt + 0.4);
  for (auto w : {whirl::signal::Window::rectangular, whirl::signal::Window::hann, whirl::signal::Window::flat_top}) {
    const auto peak = whirl::signal::amplitude_spectrum(x, dt, {.window = w});
    EXPECT_NEAR(peak.frequency[50], 50, 1e-9);
    EXPECT_NEAR(peak.amplitude[50], amplitude, 1e-9);
    EXPECT_NEAR(peak.amplitude[0], 0.7, 1e-9);
    const auto pp = whirl::signal::amplitude_spectrum(x, dt, {.window = w, .kind = AmplitudeKind::peak_to_peak});
    EXPECT_NEAR(pp.amplitude[50], 2 * amplitude, 1e-9);
    const auto rms = whirl::signal::amplitude_spectrum(x, dt, {.window = w, .kind = AmplitudeKind::rms});
    EXPECT_NEAR(rms.amplitude[50], amplitude / std::sqrt(2.0), 1e-9);
  }
}

TEST(SpectrumReference, FlatTopShowsASineBetweenLinesWithinATenthPercent) {
  const Eigen::Index n = 500;
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i)
    x[i] = std::sin(2 * whirl::kPi * 40.5 * static_cast<double>(i) / static_cast<double>(n));
  EXPECT_NEAR(whirl::signal::amplitude_spectrum(x, 1, {.window = whirl::signal::Window::flat_top}).amplitude.maxCoeff(),
              1, 1.2e-3);
}

TEST(SpectrumReference, FullSpectrumSeparatesForwardAndBackwardWhirl) {
  const Eigen::Index n = 400;
  const double dt = 1e-3;
  Eigen::VectorXd x(n), y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double a = 2 * whirl::kPi * 30 * static_cast<double>(i) * dt;
    const std::complex<double> z = 3.0 * std::polar(1.0, a + 0.3) + 1.25 * std::polar(1.0, -a + 1.1);
    x[i] = z.real();
    y[i] = z.imag();
  }
  const auto full = whirl::signal::full_spectrum(x, y, dt);
  Eigen::Index forward = 0;
  full.amplitude.maxCoeff(&forward);
  EXPECT_NEAR(full.frequency[forward], 30, 1e-9);
  EXPECT_NEAR(full.amplitude[forward], 3, 1e-9);
  const Eigen::Index backward = n / 2 - (forward - n / 2);
  EXPECT_NEAR(full.frequency[backward], -30, 1e-9);
  EXPECT_NEAR(full.amplitude[backward], 1.25, 1e-9);
}

TEST(Spectrum, BadOptionsAreErrors) {
  const Eigen::VectorXd x = Eigen::VectorXd::Ones(10);
  EXPECT_THROW(whirl::signal::amplitude_spectrum(x, 0), whirl::Error);
  EXPECT_THROW(whirl::signal::amplitude_spectrum(x, 1, {.block = 11}), whirl::Error);
  EXPECT_THROW(whirl::signal::amplitude_spectrum(x, 1, {.overlap = 1}), whirl::Error);
  EXPECT_THROW(whirl::signal::full_spectrum(x, Eigen::VectorXd::Ones(9), 1), whirl::Error);
}

TEST(WindowReference, NoiseBandwidthsAreTheTextbookOnes) {
  EXPECT_NEAR(whirl::signal::noise_bandwidth(whirl::signal::window(whirl::signal::Window::rectangular, 512)), 1, 1e-12);
  EXPECT_NEAR(whirl::signal::noise_bandwidth(whirl::signal::window(whirl::signal::Window::hann, 512)), 1.5, 1e-12);
  EXPECT_NEAR(whirl::signal::noise_bandwidth(whirl::signal::window(whirl::signal::Window::flat_top, 512)), 3.77, 0.01);
  const Eigen::VectorXd w = whirl::signal::force_window(20, 5, 4);
  EXPECT_EQ(w[4], 1);
  EXPECT_EQ(w[9], 0);
  EXPECT_NEAR(w[6], 0.5 + 0.5 * std::cos(whirl::kPi * 2 / 5), 1e-15);
}
}  // namespace
