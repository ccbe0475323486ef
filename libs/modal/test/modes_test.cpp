#include <gtest/gtest.h>

#include <numbers>

#include "measured.hpp"
#include "synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/testing/data.hpp"
#include "whirl/testing/roving.hpp"

namespace {
using Complex = std::complex<double>;
using whirl::testing::make_synthetic;
using whirl::testing::score;

whirl::FrequencyResponse building() {
  const Eigen::MatrixXd table = whirl::testing::read_csv_gz(whirl::testing::data_file("modal/building9.csv.gz"));
  whirl::FrequencyResponse frf;
  frf.frequency = table.col(0);
  frf.kind = whirl::FrfKind::accelerance;
  for (int c = 0; c < 9; ++c) {
    whirl::FrfChannel channel;
    channel.response = "point" + std::to_string(c);
    channel.reference = "exciter";
    channel.value.resize(table.rows());
    channel.value.real() = table.col(1 + 2 * c);
    channel.value.imag() = table.col(2 + 2 * c);
    frf.channels.push_back(std::move(channel));
  }
  return frf;
}

whirl::Recording measured_blow() {
  const Eigen::MatrixXd table = whirl::testing::read_csv_gz(whirl::testing::data_file("modal/hammer_raw.csv.gz"));
  whirl::Recording recording;
  recording.dt = 2e-5;
  recording.source = "hammer_raw";
  recording.add("hammer", whirl::Quantity::force, table.col(1));
  recording.add("beam", whirl::Quantity::acceleration, 9.80665 * table.col(2));
  return recording;
}

const whirl::Mode* mode_near(const whirl::ModalModel& model, double frequency) {
  for (const auto& mode : model.modes) {
    if (std::abs(mode.frequency.value / frequency - 1) < 0.002) return &mode;
  }
  return nullptr;
}

TEST(ModesReference, StoreyBuildingHasThreeModes) {
  WHIRL_REQUIRE_DATA(whirl::testing::data_file("modal/building9.csv.gz"));
  whirl::modal::ModeOptions options;
  options.poles.band_low = 5;
  options.poles.band_high = 100;
  const auto model = whirl::modal::fit_modes(building(), options);
  std::vector<const whirl::Mode*> inside;
  for (const auto& mode : model.modes) {
    if (mode.frequency.value < 100) inside.push_back(&mode);
  }
  ASSERT_EQ(inside.size(), 3u);
  EXPECT_NEAR(inside[0]->frequency.value, 21.413, 0.01);
  EXPECT_NEAR(inside[1]->frequency.value, 50.028, 0.01);
  EXPECT_NEAR(inside[2]->frequency.value, 68.312, 0.01);
  EXPECT_NEAR(inside[0]->damping.value, 0.02803, 0.0005);
  EXPECT_NEAR(inside[1]->damping.value, 0.00521, 0.0001);
  EXPECT_NEAR(inside[2]->damping.value, 0.00425, 0.0001);
  EXPECT_LT(model.reconstruction_error, 0.087);
}

TEST(ModesReference, MeasuredBlowGivesTheSameDampingWithAndWithoutWindow) {
  WHIRL_REQUIRE_DATA(whirl::testing::data_file("modal/hammer_raw.csv.gz"));
  const whirl::Recording blow = measured_blow();
  whirl::modal::ModeOptions options;
  options.poles.band_low = 20;
  options.poles.band_high = 3000;
  for (double window_end : {1.0, 0.01}) {
    const auto frf = whirl::modal::estimate_frf({blow}, {.window = {.end = window_end}});
    const auto model = whirl::modal::fit_modes(frf, options);
    const auto* first = mode_near(model, 695.75);
    const auto* second = mode_near(model, 1898.05);
    ASSERT_TRUE(first != nullptr && second != nullptr);
    EXPECT_NEAR(first->frequency.value, 695.75, 0.05);
    EXPECT_NEAR(second->frequency.value, 1898.05, 0.05);
    EXPECT_NEAR(first->damping.value, 0.00459, 3.5e-5);
    EXPECT_NEAR(second->damping.value, 0.00307, 3.5e-5);
    EXPECT_NEAR(model.window_decay, window_end < 1 ? 4.602 : 0, 0.005);
    EXPECT_NEAR(whirl::modal::damping_through_window(*first, model.window_decay), window_end < 1 ? 0.00564 : 0.00459,
                5e-5);
  }
}

// A small member of the synthetic class, quick enough for every run.
whirl::testing::SyntheticOptions small(unsigned seed) {
  whirl::testing::SyntheticOptions options;
  options.modes = 8;
  options.doublets = 1;
  options.low = 5;
  options.high = 200;
  options.responses = 3;
  options.references = 2;
  options.seed = seed;
  return options;
}

TEST(ModesReference, SyntheticClassOf35ModesFromTwelveNoisyFrfs) {
  const auto data = make_synthetic({});
  const auto model = whirl::modal::fit_modes(data.frf);
  const auto s = score(data.poles, model);
  EXPECT_GE(s.frequency, 34);
  EXPECT_GE(s.both, 33);
  EXPECT_EQ(s.sharp_extra, 0);
  EXPECT_LT(model.reconstruction_error, 1.05 * data.noise_ratio);
  EXPECT_GE(s.covered_frequency, 30);
  EXPECT_GE(s.covered_damping, 30);
}

TEST(ModesProperty, NinetyFivePercentIntervalsCoverTheTruth) {
  int modes = 0, frequency = 0, damping = 0;
  for (unsigned seed = 1; seed <= 12; ++seed) {
    auto options = small(seed);
    options.proportional = seed % 2 == 0;
    const auto data = make_synthetic(options);
    const auto model = whirl::modal::fit_modes(data.frf);
    const auto s = score(data.poles, model);
    EXPECT_EQ(s.frequency, 8) << "seed " << seed;
    EXPECT_EQ(s.extra, 0) << "seed " << seed;
    EXPECT_LT(model.reconstruction_error, 1.05 * data.noise_ratio) << "seed " << seed;
    modes += s.frequency;
    frequency += s.covered_frequency;
    damping += s.covered_damping;
  }
  // 96 intervals at 95 %: 91 +- 2.1.
  EXPECT_GE(frequency, 84);
  EXPECT_GE(damping, 84);
  EXPECT_LE(modes, 96);
}

TEST(ModesProperty, DoubletTwoPerThousandApartIsSeparatedFromTwoReferences) {
  for (unsigned seed : {1u, 2u, 3u}) {
    auto options = small(seed);
    options.doublet_gap = 0.002;
    const auto data = make_synthetic(options);
    const auto s = score(data.poles, whirl::modal::fit_modes(data.frf));
    EXPECT_EQ(s.frequency, 8) << "seed " << seed;
    EXPECT_GE(s.both, 8) << "seed " << seed;
  }
}

TEST(ModesProperty, ModelRebuildsTheFrfInEveryKind) {
  for (auto kind : {whirl::FrfKind::receptance, whirl::FrfKind::mobility, whirl::FrfKind::accelerance}) {
    auto options = small(4);
    options.kind = kind;
    options.noise = 0;
    options.line = 0.125;
    const auto data = make_synthetic(options);
    const auto model = whirl::modal::fit_modes(data.frf);
    EXPECT_LT(model.reconstruction_error, 1e-3) << to_string(kind);
    const Eigen::VectorXcd h = whirl::modal::synthesise(model, 2, data.frf.frequency, kind);
    EXPECT_LT((h - data.clean[2]).norm() / data.clean[2].norm(), 2e-3) << to_string(kind);
    EXPECT_EQ(score(data.poles, model).both, 8) << to_string(kind);
  }
}

TEST(ModesProperty, ResiduesOfKnownPolesAreExact) {
  // h = sum a/(s - p) + a*/(s - p*) + L/s^2 + U as mobility, seen through an exponential window.
  const std::vector<Complex> poles = {{-2, 300}, {-5, 700}};
  const std::vector<Complex> a = {{1e-4, -2e-3}, {3e-4, 1e-3}};
  const double lower = 3.0, upper = 2e-6, decay = 4;
  whirl::FrequencyResponse frf;
  frf.kind = whirl::FrfKind::mobility;
  frf.window_decay = decay;
  frf.frequency = Eigen::VectorXd::LinSpaced(1200, 0, 150);
  whirl::FrfChannel channel{"1:+X", "1:+X", Eigen::VectorXcd(1200), {}, {}};
  for (Eigen::Index i = 0; i < 1200; ++i) {
    const Complex s(decay, 2 * std::numbers::pi * frf.frequency[i]);
    Complex h = lower / (s * s) + upper;
    for (int k = 0; k < 2; ++k) {
      const auto u = static_cast<std::size_t>(k);
      h += a[u] / (s - poles[u]) + std::conj(a[u]) / (s - std::conj(poles[u]));
    }
    channel.value[i] = s * h;
  }
  frf.channels.push_back(channel);
  const auto fit = whirl::modal::fit_residues(frf, poles);
  EXPECT_LT(fit.reconstruction_error, 1e-8);
  EXPECT_NEAR(std::abs(fit.residues(0, 0) - a[0]) / std::abs(a[0]), 0, 1e-6);
  EXPECT_NEAR(std::abs(fit.residues(1, 0) - a[1]) / std::abs(a[1]), 0, 1e-6);
  EXPECT_NEAR(fit.lower[0].real(), lower, 1e-4);
  EXPECT_NEAR(fit.upper[0].real(), upper, 1e-8);
  EXPECT_THROW(whirl::modal::fit_residues(frf, {Complex(1, 300)}), whirl::Error);
}

TEST(Modes, StabilisationDiagramTracesEveryModeOverTheOrders) {
  const auto data = make_synthetic(small(3));
  auto diagram = whirl::modal::stabilisation_diagram(data.frf);
  const auto clusters = whirl::modal::select_poles(diagram);
  EXPECT_EQ(diagram.references.size(), 2u);
  EXPECT_GE(diagram.orders.size(), 8u);
  for (const Complex truth : data.poles) {
    const bool found = std::any_of(clusters.begin(), clusters.end(),
                                   [&](const auto& c) { return std::abs(c.pole - truth) < 3e-3 * std::abs(truth); });
    EXPECT_TRUE(found) << std::abs(truth) / (2 * std::numbers::pi);
  }
  for (const auto& pole : diagram.poles) {
    EXPECT_LT(pole.pole.real(), 0);
    EXPECT_NEAR(pole.participation.norm(), 1, 1e-9);
    EXPECT_LT(pole.cluster, static_cast<int>(clusters.size()));
  }
}

TEST(Modes, BadInputIsAnError) {
  auto data = make_synthetic(small(1));
  whirl::modal::ModeOptions options;
  options.poles.band_low = 100;
  options.poles.band_high = 50;
  EXPECT_THROW(whirl::modal::fit_modes(data.frf, options), whirl::Error);
  options.poles.band_high = 100.2;
  EXPECT_THROW(whirl::modal::fit_modes(data.frf, options), whirl::Error);  // too few lines
  options = {};
  options.poles.weighting = whirl::modal::LineWeighting::variance;
  EXPECT_THROW(whirl::modal::fit_modes(data.frf, options), whirl::Error);
  data.frf.channels[0].value[3] = NAN;
  EXPECT_THROW(whirl::modal::fit_modes(data.frf), whirl::Error);
  for (auto& channel : data.frf.channels) channel.value.setZero();
  EXPECT_THROW(whirl::modal::fit_modes(data.frf), whirl::Error);
  EXPECT_THROW(whirl::modal::mac(Eigen::VectorXcd::Ones(2), Eigen::VectorXcd::Ones(3)), whirl::Error);
}

TEST(Modes, DeadChannelIsLeftOutAndNamed) {
  auto data = make_synthetic(small(1));
  data.frf.channels[2].value.setZero();
  const auto model = whirl::modal::fit_modes(data.frf);
  EXPECT_EQ(score(data.poles, model).frequency, 8);
  EXPECT_EQ(model.responses.size(), data.frf.channels.size() - 1);
  const std::string name = data.frf.channels[2].response + "/" + data.frf.channels[2].reference;
  EXPECT_TRUE(std::any_of(model.summary.warnings.begin(), model.summary.warnings.end(),
                          [&](const std::string& w) { return w.find(name) != std::string::npos; }));
}

TEST(Modes, BandWithoutAModeSaysSo) {
  whirl::modal::ModeOptions options;
  options.poles.band_low = 12;
  options.poles.band_high = 20;
  const auto data = whirl::testing::make_roving({.modes = 2, .low = 5, .high = 200, .modes_above = 0, .seed = 7});
  ASSERT_GT(data.frequency[0], 22);
  EXPECT_EQ(whirl::modal::fit_modes(data.frf, options).summary.status, whirl::Status::unusable);
}

TEST(ModesReference, NoiseFreeDataOf35ModesGiveNoOtherPoleInTheBand) {
  auto options = whirl::testing::SyntheticOptions{};
  options.noise = 0;
  const auto data = make_synthetic(options);
  const auto model = whirl::modal::fit_modes(data.frf);
  const auto s = score(data.poles, model);
  EXPECT_EQ(s.both, 35);
  EXPECT_EQ(s.extra, 0);
  EXPECT_LT(model.reconstruction_error, 1e-4);
}

// Blows differ most where the structure rings most, so that weights by the measured variance all but hide a dominant
// pair.
TEST(ModesProperty, DominantDoubletIsFoundWhenTheVarianceFollowsTheResonance) {
  auto options = small(2);
  options.responses = 2;
  options.references = 1;
  auto data = make_synthetic(options);
  const std::vector<Complex> dominant = {{-0.45, 74.5}, {-0.55, 76.0}};
  for (auto& channel : data.frf.channels) {
    channel.variance.resize(channel.value.size());
    for (Eigen::Index i = 0; i < channel.value.size(); ++i) {
      const Complex s(0, 2 * std::numbers::pi * data.frf.frequency[i]);
      Complex pair = 0;
      for (const Complex p : dominant) pair += s * s / ((s - p) * (s - std::conj(p)));
      const double sd = 2e-3 * std::abs(pair);
      channel.value[i] += 30.0 * pair;
      channel.variance[i] = std::norm(30 * sd) + 1e-6;
    }
  }
  const auto model = whirl::modal::fit_modes(data.frf);
  for (const Complex p : dominant) {
    EXPECT_NE(mode_near(model, std::abs(p) / (2 * std::numbers::pi)), nullptr) << p.imag();
  }
}

TEST(Modes, NoiseAloneHasNoModes) {
  auto options = small(1);
  const auto data = make_synthetic(options);
  auto frf = data.frf;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (auto& channel : frf.channels) {
    for (auto& value : channel.value) value = {normal(random), normal(random)};
  }
  const auto model = whirl::modal::fit_modes(frf);
  EXPECT_EQ(score({}, model).poles, 0);
  EXPECT_EQ(model.summary.status, whirl::Status::unusable);
}
}  // namespace
