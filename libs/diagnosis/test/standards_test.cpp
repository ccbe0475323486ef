#include "whirl/diagnosis/standards.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "whirl/diagnosis/vibration.hpp"

namespace {
constexpr double kRpm = 2 * std::numbers::pi / 60;

TEST(StandardsReference, AmplificationOfALightlyDampedResonanceIsHalfOfOneOverTheDampingRatio) {
  const double w0 = 1000 * kRpm, zeta = 0.02;
  whirl::signal::SynchronousCurve curve{"x", Eigen::VectorXd::LinSpaced(4001, 0.8 * w0, 1.2 * w0), {}};
  curve.vector = curve.speed.unaryExpr(
      [&](double w) { return 1e-5 * w * w / std::complex<double>(w0 * w0 - w * w, 2 * zeta * w0 * w); });
  const auto a = whirl::diagnosis::amplification(curve);
  ASSERT_TRUE(a.has_value());
  EXPECT_NEAR(a->factor, 1 / (2 * zeta), 0.01 / (2 * zeta));
  EXPECT_NEAR(a->critical, w0 / std::sqrt(1 - 2 * zeta * zeta), 1e-3 * w0);
  // Without a fall on both sides there is nothing to read.
  curve.speed = curve.speed.head(1900).eval();
  curve.vector = curve.vector.head(1900).eval();
  EXPECT_FALSE(whirl::diagnosis::amplification(curve).has_value());
}

TEST(StandardsReference, SweepRateFromOneVectorPerRevolution) {
  const double alpha = 24;  // rad/s^2
  whirl::signal::SynchronousCurve curve{"x", Eigen::VectorXd(200), Eigen::VectorXcd(200)};
  for (Eigen::Index k = 0; k < 200; ++k) {
    curve.speed[k] = std::sqrt(100 * 100 + 2 * alpha * 2 * std::numbers::pi * static_cast<double>(k));
    curve.vector[k] = 1 / (1 + std::pow((static_cast<double>(k) - 100) / 10, 2));
  }
  const auto a = whirl::diagnosis::amplification(curve);
  ASSERT_TRUE(a.has_value());
  EXPECT_NEAR(a->sweep_rate, alpha, 1e-9);
}

TEST(StandardsReference, AZoneWithAPartOfItsBandMissingIsALowerBound) {
  const whirl::diagnosis::MachineClass machine{2, true};
  whirl::diagnosis::ChannelVibration v;
  v.housing = whirl::signal::BandLevel{.rms = 1e-3, .low = 10, .high = 1000};
  const auto zone = [&] { return whirl::diagnosis::housing_zone(v, machine); };
  EXPECT_EQ(zone().zone, 'A');
  EXPECT_FALSE(zone().at_least);
  v.housing->high = 500;  // sampled at 1 kHz
  EXPECT_TRUE(zone().at_least);
  v.housing->high = 1000;
  v.synchronous = whirl::diagnosis::SynchronousPart{1e-3, 500 * kRpm, true};  // 8.3 Hz: below the band
  EXPECT_TRUE(zone().at_least);
  v.synchronous->speed = 1500 * kRpm;
  EXPECT_FALSE(zone().at_least);
  v.housing->high = 500;
  v.housing->rms = 0.1;
  EXPECT_EQ(zone().zone, 'D');
  EXPECT_FALSE(zone().at_least);  // there is no worse one
}

TEST(StandardsReference, LimitsAsQuoted) {
  EXPECT_EQ(whirl::diagnosis::required_margin(2.4, true), 0);
  EXPECT_NEAR(whirl::diagnosis::required_margin(5, true), 0.01 * 17 * (1 - 1 / 3.5), 1e-12);
  EXPECT_NEAR(whirl::diagnosis::required_margin(1e9, true), 0.16, 1e-12);
  EXPECT_NEAR(whirl::diagnosis::required_margin(1e9, false), 0.26, 1e-12);
  EXPECT_NEAR(whirl::diagnosis::shaft_vibration_limit('A', 3600 * kRpm), 80e-6, 1e-12);
  EXPECT_EQ(whirl::diagnosis::shaft_vibration_zone(79e-6, 3600 * kRpm), 'A');
  EXPECT_EQ(whirl::diagnosis::shaft_vibration_zone(149e-6, 3600 * kRpm), 'B');
  EXPECT_EQ(whirl::diagnosis::shaft_vibration_zone(151e-6, 3600 * kRpm), 'C');
  EXPECT_EQ(whirl::diagnosis::shaft_vibration_zone(221e-6, 3600 * kRpm), 'D');
  // 9549 G / n micrometres at G 6.3 and 3000 rpm.
  EXPECT_NEAR(whirl::diagnosis::balance_grade(9549 * 6.3 / 3000 * 1e-6, 3000 * kRpm), 6.3e-3, 1e-6);
  EXPECT_EQ(whirl::diagnosis::balance_grade_class(6.2e-3), 6.3);
}
}  // namespace
