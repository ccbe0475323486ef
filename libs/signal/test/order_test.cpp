#include "whirl/signal/order.hpp"

#include <gtest/gtest.h>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/envelope.hpp"
#include "whirl/signal/spectrogram.hpp"

namespace {
using Complex = std::complex<double>;

// Run-up from 15 to 40 Hz in 6 s at 2 kHz.
struct RunUp {
  double dt = 5e-4;
  Eigen::VectorXd angle;
  RunUp() : angle(12000) {
    for (Eigen::Index i = 0; i < angle.size(); ++i) {
      const double t = static_cast<double>(i) * dt;
      angle[i] = 0.4 + 2 * whirl::kPi * (15 * t + 0.5 * 25.0 / 6 * t * t);
    }
  }
  double speed(double t) const { return 2 * whirl::kPi * (15 + 25.0 / 6 * t); }
};

// Amplitude and phase of a lightly damped resonance at 27 Hz.
Complex response(double omega) {
  const double w0 = 2 * whirl::kPi * 27;
  return 1e-4 * omega * omega / Complex(w0 * w0 - omega * omega, 2 * 0.05 * w0 * omega);
}

TEST(OrderReference, VectorsOfAConstantOrderAreExactThroughARunUp) {
  const RunUp run;
  const Complex z1 = std::polar(3e-5, 0.7), z2 = std::polar(1e-5, -2.0);
  Eigen::VectorXd x(run.angle.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = 2e-4 + (z1 * std::polar(1.0, run.angle[i]) + z2 * std::polar(1.0, 2 * run.angle[i])).real();
  }
  const auto first = whirl::signal::order_vectors(x, run.angle, run.dt);
  const auto second = whirl::signal::order_vectors(x, run.angle, run.dt, 2);
  ASSERT_GT(first.value.size(), 150);
  for (Eigen::Index k = 1; k + 1 < first.value.size(); ++k) {
    EXPECT_LT(std::abs(first.value[k] - z1), 1e-3 * std::abs(z1)) << "revolution " << k;
    EXPECT_LT(std::abs(second.value[k] - z2), 3e-3 * std::abs(z2)) << "revolution " << k;
    EXPECT_NEAR(first.speed[k], run.speed(first.time[k]), 2e-3 * first.speed[k]);
  }
}

TEST(OrderReference, VectorsFollowAResonanceWithinOnePercentAndOneDegree) {
  const RunUp run;
  Eigen::VectorXd x(run.angle.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = (response(run.speed(static_cast<double>(i) * run.dt)) * std::polar(1.0, run.angle[i])).real();
  }
  const auto vectors = whirl::signal::order_vectors(x, run.angle, run.dt);
  for (Eigen::Index k = 1; k + 1 < vectors.value.size(); ++k) {
    const Complex exact = response(run.speed(vectors.time[k]));
    EXPECT_NEAR(std::abs(vectors.value[k] / exact), 1, 0.01) << vectors.speed[k];
    EXPECT_LT(std::abs(std::arg(vectors.value[k] / exact)), whirl::kPi / 180) << vectors.speed[k];
  }
}

TEST(OrderReference, HalfOrderNeedsTwoTurns) {
  const RunUp run;
  const Complex z = std::polar(2e-5, 1.2);
  Eigen::VectorXd x(run.angle.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = (z * std::polar(1.0, 0.5 * run.angle[i])).real();
  const auto vectors = whirl::signal::order_vectors(x, run.angle, run.dt, 0.5, 2);
  for (Eigen::Index k = 1; k + 1 < vectors.value.size(); ++k)
    EXPECT_LT(std::abs(vectors.value[k] - z), 2e-3 * std::abs(z));
  EXPECT_THROW(whirl::signal::order_vectors(x, run.angle, run.dt, 0.5, 1), whirl::Error);
}

TEST(OrderReference, VoldKalmanTracksAResonanceWithinOnePercentAndOneDegree) {
  const RunUp run;
  Eigen::VectorXd x(run.angle.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = (response(run.speed(static_cast<double>(i) * run.dt)) * std::polar(1.0, run.angle[i])).real();
  }
  const Eigen::MatrixXcd a = whirl::signal::track_orders(x, run.angle, run.dt, {1}, {.bandwidth = 8});
  for (Eigen::Index i = 800; i < x.size() - 800; ++i) {
    const Complex exact = response(run.speed(static_cast<double>(i) * run.dt));
    ASSERT_NEAR(std::abs(a(i, 0) / exact), 1, 0.01) << i;
    ASSERT_LT(std::abs(std::arg(a(i, 0) / exact)), whirl::kPi / 180) << i;
  }
}

TEST(OrderReference, SpectraOfATurningShaftKeepOrdersApartInAFastRun) {
  // 5 to 25 Hz in 4 s: 1X moves by 5 Hz/s, 2X by 10 Hz/s, and at 5 Hz they lie 5 Hz apart.
  constexpr double dt = 1e-3;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(4000, 0, 3999 * dt);
  const Eigen::VectorXd angle = 2 * whirl::kPi * (5 * t.array() + 2.5 * t.array().square());
  const Eigen::VectorXd x = 2e-4 * (angle.array() + 0.4).cos() + 5e-5 * (2 * angle.array() - 1.1).cos();
  const Eigen::VectorXd y = 2e-4 * (angle.array() + 0.4).sin();
  whirl::signal::SpectrumOptions options;
  options.block = 400;
  for (const bool full : {false, true}) {
    const auto map = whirl::signal::turning_spectrogram(x, full ? &y : nullptr, angle, dt, 100, options, 60);
    ASSERT_GT(map.time.size(), 40);
    for (Eigen::Index j = 0; j < map.time.size(); ++j) {
      const double speed = 5 + 5 * map.time[j];
      double first = 0, second = 0, between = INFINITY;
      for (Eigen::Index i = 0; i < map.frequency.size(); ++i) {
        const double order = map.frequency[i] / speed, a = map.amplitude(i, j);
        if (std::abs(order - 1) < 0.3) first = std::max(first, a);
        if (std::abs(order - 2) < 0.3) second = std::max(second, a);
        if (order > 1.25 && order < 1.75) between = std::min(between, a);
      }
      EXPECT_NEAR(first, 2e-4, 1e-6) << map.time[j];
      EXPECT_NEAR(second, full ? 2.5e-5 : 5e-5, 5e-7) << map.time[j];
      EXPECT_LT(between, 0.5e-5) << map.time[j];
    }
  }
}

TEST(OrderReference, VoldKalmanSeparatesNeighbouringOrders) {
  // Two orders only a tenth apart, a beat of 1.5 to 4 Hz: found one by one they would leak into each other.
  const RunUp run;
  const Complex z1 = std::polar(2.0, 0.3), z3 = std::polar(0.5, -1.0);
  Eigen::VectorXd x(run.angle.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = (z1 * std::polar(1.0, run.angle[i]) + z3 * std::polar(1.0, 1.1 * run.angle[i])).real();
  }
  const Eigen::MatrixXcd a = whirl::signal::track_orders(x, run.angle, run.dt, {1, 1.1}, {.bandwidth = 1.5});
  for (Eigen::Index i = 3000; i < 9000; ++i) {
    ASSERT_LT(std::abs(a(i, 0) - z1), 0.01 * std::abs(z1)) << i;
    ASSERT_LT(std::abs(a(i, 1) - z3), 0.01 * std::abs(z3)) << i;
  }
}

TEST(OrderReference, OrbitEllipseOfKnownWhirl) {
  const Complex f = std::polar(3.0, 0.5), b = std::polar(1.0, -0.9);
  // x + j y = f e^{j theta} + b e^{-j theta}.
  const Complex x = f + std::conj(b), y = Complex(0, -1) * (f - std::conj(b));
  const auto e = whirl::signal::orbit_ellipse(x, y);
  EXPECT_LT(std::abs(e.forward - f), 1e-12);
  EXPECT_LT(std::abs(e.backward - b), 1e-12);
  EXPECT_NEAR(e.semi_major, 4, 1e-12);
  EXPECT_NEAR(e.semi_minor, 2, 1e-12);
  EXPECT_NEAR(e.axis, (0.5 - 0.9) / 2, 1e-12);
  EXPECT_NEAR(e.area, whirl::kPi * 8, 1e-12);
}

TEST(EnvelopeReference, AmplitudeModulationIsRecovered) {
  const Eigen::Index n = 4000;
  Eigen::VectorXd x(n), m(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / 1000;
    m[i] = 1 + 0.4 * std::cos(2 * whirl::kPi * 2 * t);
    x[i] = 7 + m[i] * std::cos(2 * whirl::kPi * 100 * t + 0.2);
  }
  EXPECT_LT((whirl::signal::envelope(x) - m).cwiseAbs().maxCoeff(), 1e-6);
  const Eigen::VectorXd odd = x.head(3999);
  EXPECT_LT((whirl::signal::analytic_signal(odd).real() - odd).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Order, BadInputIsAnError) {
  const RunUp run;
  const Eigen::VectorXd x = Eigen::VectorXd::Ones(run.angle.size());
  EXPECT_THROW(whirl::signal::order_vectors(x.head(10), run.angle, run.dt), whirl::Error);
  EXPECT_THROW(whirl::signal::order_vectors(x, Eigen::VectorXd(-run.angle), run.dt), whirl::Error);
  EXPECT_THROW(whirl::signal::order_vectors(x.head(20), run.angle.head(20), run.dt), whirl::Error);
  EXPECT_THROW(whirl::signal::track_orders(x, run.angle, run.dt, {1}, {.bandwidth = 1e-3, .poles = 3}), whirl::Error);
}
}  // namespace
