#include "whirl/modal/frf.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "measured.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/data.hpp"

namespace {
using Complex = std::complex<double>;

struct Blow {
  double time, peak;
};

// Two modes with exact answer h(s) = sum a/(s - p) + a*/(s - p*), receptance.
const std::vector<Complex> kPoles = {2 * whirl::kPi * 60 * Complex(-0.004, 1),
                                     2 * whirl::kPi * 210 * Complex(-0.003, 1)};
const std::vector<Complex> kResidues = {Complex(0, -1e-3), Complex(2e-5, -4e-4)};

Complex truth(Complex s) {
  Complex h = 0;
  for (std::size_t k = 0; k < kPoles.size(); ++k) {
    h += kResidues[k] / (s - kPoles[k]) + std::conj(kResidues[k]) / (s - std::conj(kPoles[k]));
  }
  return h;
}

// Half-sine blows of 2 ms and the exact response to them (force linear between samples).
whirl::Recording simulate(const std::vector<Blow>& blows, double duration, double noise, unsigned seed,
                          double dt = 1e-4) {
  const auto n = static_cast<Eigen::Index>(std::lround(duration / dt));
  Eigen::VectorXd f = Eigen::VectorXd::Zero(n), x = Eigen::VectorXd::Zero(n);
  for (const auto& blow : blows) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = static_cast<double>(i) * dt - blow.time + 1e-3;
      if (t > 0 && t < 2e-3) f[i] += blow.peak * std::sin(whirl::kPi * t / 2e-3);
    }
  }
  for (std::size_t k = 0; k < kPoles.size(); ++k) {
    const Complex p = kPoles[k], e = std::exp(p * dt);
    const Complex from_old = (e * (p * dt - 1.0) + 1.0) / (p * p * dt), from_new = (e - 1.0 - p * dt) / (p * p * dt);
    Complex q = 0;
    for (Eigen::Index i = 1; i < n; ++i) {
      q = e * q + from_old * f[i - 1] + from_new * f[i];
      x[i] += 2 * (kResidues[k] * q).real();
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double fs = noise * f.maxCoeff(), xs = noise * x.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < n; ++i) {
    f[i] += fs * normal(random) + 0.3;  // both channels carry an offset
    x[i] += xs * normal(random) - 1e-6;
  }
  whirl::Recording recording;
  recording.dt = dt;
  recording.source = "simulated";
  recording.add("hammer", whirl::Quantity::force, f);
  recording.add("disk:+X", whirl::Quantity::displacement, x);
  return recording;
}

// Relative error of the FRF between 10 and 300 Hz against the exact one seen through the window.
double error(const whirl::FrequencyResponse& frf) {
  double difference = 0, size = 0;
  for (Eigen::Index i = 0; i < frf.frequency.size(); ++i) {
    const double f = frf.frequency[i];
    if (f < 10 || f > 300) continue;
    const Complex h = truth(Complex(frf.window_decay, 2 * whirl::kPi * f));
    difference += std::norm(frf.channels[0].value[i] - h);
    size += std::norm(h);
  }
  return std::sqrt(difference / size);
}

TEST(FrfReference, WindowedImpactGivesTheExactFrfSeenThroughTheWindow) {
  const auto clean = whirl::modal::estimate_frf({simulate({{0.1, 200}}, 2, 0, 1)}, {.window = {.end = 0.01}});
  EXPECT_LT(error(clean), 1e-3);
  EXPECT_EQ(clean.kind, whirl::FrfKind::receptance);
  EXPECT_NEAR(clean.window_decay, std::log(100) / (clean.frequency[1] > 0 ? 1 / clean.frequency[1] : 1), 1e-6);
  const auto noisy = whirl::modal::estimate_frf({simulate({{0.1, 200}}, 2, 1e-3, 1)}, {.window = {.end = 0.01}});
  EXPECT_LT(error(noisy), 0.033);
  const auto unwindowed = whirl::modal::estimate_frf({simulate({{0.1, 200}}, 8, 0, 1)}, {.window = {.force = false}});
  EXPECT_LT(error(unwindowed), 1e-3);
}

TEST(FrfProperty, EstimatorsOfOneNoisyBlowSetAgreeWithTheirDefinitions) {
  std::vector<whirl::Recording> blows;
  for (unsigned i = 0; i < 8; ++i) blows.push_back(simulate({{0.1, 150 + 10.0 * i}}, 2, 5e-3, 10 + i));
  const auto h1 = whirl::modal::estimate_frf(blows, {.estimator = whirl::FrfEstimator::h1});
  const auto h2 = whirl::modal::estimate_frf(blows, {.estimator = whirl::FrfEstimator::h2});
  const auto low = whirl::modal::estimate_frf(blows, {.estimator = whirl::FrfEstimator::hv, .noise_ratio = 1e-30});
  const auto high = whirl::modal::estimate_frf(blows, {.estimator = whirl::FrfEstimator::hv, .noise_ratio = INFINITY});
  EXPECT_EQ(h1.averages, 8);
  const auto& c1 = h1.channels[0];
  for (Eigen::Index i = 20; i < 600; ++i) {
    // H1 / H2 = gamma^2, and Hv runs from H2 to H1 as k grows.
    EXPECT_NEAR(std::abs(c1.value[i] / h2.channels[0].value[i] - c1.coherence[i]), 0, 1e-9);
    EXPECT_NEAR(std::abs(low.channels[0].value[i] / h2.channels[0].value[i]), 1, 1e-6);
    EXPECT_NEAR(std::abs(high.channels[0].value[i] / c1.value[i]), 1, 1e-12);
    EXPECT_GE(c1.coherence[i], 0);
    EXPECT_LE(c1.coherence[i], 1);
  }
}

TEST(FrfProperty, StatedVarianceIsTheScatterOverRepeatedMeasurements) {
  const Eigen::Index line = 130;  // 65 Hz of a 2 s record
  std::vector<double> magnitude;
  double stated = 0;
  for (unsigned run = 0; run < 60; ++run) {
    std::vector<whirl::Recording> blows;
    for (unsigned i = 0; i < 5; ++i) blows.push_back(simulate({{0.05, 150}}, 1, 5e-3, 1000 + 10 * run + i, 5e-4));
    const auto frf = whirl::modal::estimate_frf(blows, {.window = {.force = true}});
    magnitude.push_back(std::abs(frf.channels[0].value[line]));
    stated += frf.channels[0].variance[line] / 60;
  }
  double mean = 0, variance = 0;
  for (double m : magnitude) mean += m / 60;
  for (double m : magnitude) variance += (m - mean) * (m - mean) / 59;
  EXPECT_GT(variance / stated, 0.5);
  EXPECT_LT(variance / stated, 2.0);
}

TEST(Frf, CoherenceOfOneBlowIsUndefined) {
  const auto one = whirl::modal::estimate_frf({simulate({{0.1, 200}}, 1, 1e-3, 1)});
  EXPECT_EQ(one.channels[0].coherence.size(), 0);
  EXPECT_EQ(one.channels[0].variance.size(), 0);
  EXPECT_EQ(one.averages, 1);
}

TEST(Frf, SeveralBlowsOfOneRecordingAreCutAndAveraged) {
  const auto record = simulate({{0.5, 200}, {3.5, 150}, {6.5, 180}}, 9.5, 1e-3, 4);
  std::vector<whirl::modal::BlowReport> reports;
  const auto frf = whirl::modal::estimate_frf({record}, {.cut = {.duration = 2.5}, .window = {.end = 0.01}}, &reports);
  EXPECT_EQ(frf.averages, 3);
  ASSERT_EQ(reports.size(), 3u);
  EXPECT_NEAR(reports[1].time, 3.5, 2e-4);
  EXPECT_NEAR(reports[1].peak, 150, 2);
  EXPECT_LT(error(frf), 0.033);
  EXPECT_GT(frf.channels[0].coherence[300], 0.9);
}

TEST(FrfProperty, SecondHitIsFoundFrom5To300MsWhateverTheRecordLength) {
  for (double length : {1.0, 4.0, 16.0}) {
    for (double gap : {0.005, 0.012, 0.028, 0.12, 0.3}) {
      const auto record = simulate({{0.05, 200}, {0.05 + gap, 70}}, length, 2e-4, 7);
      const auto check = whirl::modal::check_blow(record["hammer"], record.dt);
      ASSERT_EQ(check.second_hits.size(), 1u) << gap << " s in " << length << " s";
      EXPECT_NEAR(check.second_hits[0].time, gap, 2e-4);
      EXPECT_NEAR(check.second_hits[0].ratio, 0.35, 0.01);
    }
    EXPECT_TRUE(whirl::modal::check_blow(simulate({{0.05, 200}}, length, 2e-4, 7)["hammer"], 1e-4).second_hits.empty());
  }
}

TEST(Frf, ReboundInsideTheRecordDoesNotSpoilH1) {
  std::vector<whirl::modal::BlowReport> reports;
  const auto frf = whirl::modal::estimate_frf({simulate({{0.1, 200}, {0.128, 70}}, 4, 2e-4, 3)},
                                              {.window = {.end = 0.01}}, &reports);
  EXPECT_EQ(reports[0].second_hits.size(), 1u);
  EXPECT_TRUE(reports[0].used);
  EXPECT_LT(error(frf), 0.033);
  EXPECT_FALSE(frf.summary.warnings.empty());
}

TEST(FrfProperty, ClippingOfTwoSamplesOrMoreIsFound) {
  const auto record = simulate({{0.1, 200}}, 1, 2e-4, 3);
  EXPECT_FALSE(whirl::modal::check_blow(record["hammer"], record.dt).overload);
  for (Eigen::Index clipped : {2, 4, 8}) {
    Eigen::VectorXd f = record["hammer"];
    Eigen::VectorXd sorted = f;
    std::sort(sorted.data(), sorted.data() + sorted.size());
    f = f.cwiseMin(sorted[sorted.size() - clipped]);
    EXPECT_TRUE(whirl::modal::check_blow(f, record.dt).overload) << clipped << " samples";
    auto bad = record;
    bad.channels[0].samples = f;
    EXPECT_THROW(whirl::modal::estimate_frf({bad}), whirl::Error);
    EXPECT_EQ(whirl::modal::estimate_frf({bad}, {.exclude = {.overloads = false}}).averages, 1);
  }
  EXPECT_TRUE(whirl::modal::check_blow(record["hammer"], record.dt, 200).overload);
}

TEST(Frf, SlowQuantisedSignalRestsOnItsExtremeWithoutBeingClipped) {
  Eigen::VectorXd x(4000);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x[i] = std::round(1000 * std::sin(2 * whirl::kPi * 3 * static_cast<double>(i) / 4000));
  EXPECT_FALSE(whirl::modal::is_overloaded(x));
  EXPECT_TRUE(whirl::modal::is_overloaded(x.cwiseMin(800.0)) || whirl::modal::is_overloaded(x, 1000));
  EXPECT_TRUE(whirl::modal::is_overloaded(x, 1000));
}

TEST(Frf, BadInputIsAnError) {
  auto record = simulate({{0.1, 200}}, 1, 0, 1);
  EXPECT_THROW(whirl::modal::estimate_frf({}), whirl::Error);
  EXPECT_THROW(whirl::modal::estimate_frf({record}, {.force = "none"}), whirl::Error);
  EXPECT_THROW(whirl::modal::estimate_frf({record}, {.force = "disk:+X"}), whirl::Error);  // a displacement
  EXPECT_THROW(whirl::modal::estimate_frf({record}, {.window = {.end = 0}}), whirl::Error);
  for (const double shorter : {1e-300, 0.4 * record.dt, 15 * record.dt})
    EXPECT_THROW(whirl::modal::estimate_frf({record}, {.cut = {.duration = shorter}}), whirl::Error) << shorter;
  auto volts = record;
  volts.channels[1].quantity = whirl::Quantity::voltage;
  EXPECT_THROW(whirl::modal::estimate_frf({volts}), whirl::Error);
  auto mixed = record;
  mixed.add("acc", whirl::Quantity::acceleration, record.channels[1].samples);
  EXPECT_THROW(whirl::modal::estimate_frf({mixed}), whirl::Error);
}

TEST(FrfReference, MeasuredBlowHasNoSecondHitAndNoOverload) {
  const auto path = whirl::testing::data_file("modal/hammer_raw.csv.gz");
  WHIRL_REQUIRE_DATA(path);
  const Eigen::MatrixXd table = whirl::testing::read_csv_gz(path);
  ASSERT_EQ(table.rows(), 50030);
  const auto check = whirl::modal::check_blow(table.col(1), 2e-5);
  EXPECT_FALSE(check.overload);
  EXPECT_TRUE(check.second_hits.empty());
  EXPECT_NEAR(check.peak, 195.6, 0.3);
  EXPECT_NEAR(check.time, 0.72e-3, 2e-5);
  EXPECT_NEAR(check.pulse_width, 2e-4, 2e-5);
}
}  // namespace
