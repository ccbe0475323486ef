// Modes from ambient records, against a structure of known modes.
#include "whirl/modal/oma.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "whirl/core/error.hpp"
#include "whirl/modal/fdd.hpp"
#include "whirl/modal/poles.hpp"
#include "whirl/testing/ambient.hpp"
#include "whirl/testing/damaged_channels.hpp"

namespace {

using whirl::modal::identify_operational;
using whirl::modal::OperationalModes;
using whirl::testing::make_ambient;

struct Score {
  int found = 0, extra = 0, frequency = 0, damping = 0;
  std::vector<double> damping_error;
};

void add(const whirl::testing::Ambient& truth, const OperationalModes& found, Score& score) {
  std::vector<bool> used(found.modes.size());
  for (std::size_t k = 0; k < truth.frequency.size(); ++k) {
    std::size_t best = found.modes.size();
    double distance = 0.006;
    for (std::size_t m = 0; m < found.modes.size(); ++m) {
      const double d = std::abs(found.modes[m].frequency.value / truth.frequency[k] - 1);
      if (used[m] || d >= distance) continue;
      distance = d;
      best = m;
    }
    if (best == found.modes.size()) continue;
    used[best] = true;
    ++score.found;
    score.frequency += found.modes[best].frequency.covers(truth.frequency[k]);
    score.damping += found.modes[best].damping.covers(truth.damping[k]);
    score.damping_error.push_back(std::abs(found.modes[best].damping.value / truth.damping[k] - 1));
  }
  score.extra += static_cast<int>(std::count(used.begin(), used.end(), false));
}

TEST(OmaProperty, FiveAmbientRecordsShowEveryModeAndBothTones) {
  Score score;
  for (unsigned seed = 31; seed <= 35; ++seed) {
    const auto truth = make_ambient({.structure = 5, .seed = seed});
    const OperationalModes found = identify_operational(truth.recording);
    add(truth, found, score);
    ASSERT_EQ(found.tones.size(), 2u);
    EXPECT_NEAR(found.tones[0].frequency, 14, 0.002);
    EXPECT_NEAR(found.tones[1].frequency, 28, 0.002);
  }
  EXPECT_EQ(score.found, 40);
  EXPECT_EQ(score.extra, 0);
  // 40 intervals at 95 %.
  EXPECT_GE(score.frequency, 34);
  EXPECT_GE(score.damping, 34);
}

// Their peaks were modes of the enhanced frequency domain decomposition, one without a damping.
TEST(OmaProperty, DecompositionInTheFrequencyDomainListsNoTone) {
  for (unsigned seed = 31; seed <= 34; ++seed) {
    const auto truth = make_ambient({.structure = 5, .seed = seed});
    const whirl::modal::AmbientModes found = whirl::modal::decompose_ambient(truth.recording);
    EXPECT_GE(found.modes.size(), 4u);
    for (const whirl::modal::AmbientMode& mode : found.modes) {
      EXPECT_GT(std::abs(mode.frequency - 14), 0.2) << seed;
      EXPECT_GT(std::abs(mode.frequency - 28), 0.2) << seed;
    }
    EXPECT_THAT(found.summary.warnings, ::testing::Contains(::testing::HasSubstr("14 Hz is a tone, not a mode")));
    EXPECT_THAT(found.summary.warnings, ::testing::Contains(::testing::HasSubstr("28 Hz is a tone, not a mode")));
    const auto quiet = make_ambient({.tones = {}, .structure = 5, .seed = seed});
    EXPECT_THAT(whirl::modal::decompose_ambient(quiet.recording).summary.warnings,
                ::testing::Not(::testing::Contains(::testing::HasSubstr("is a tone"))));
  }
}

// Few modes on few channels: poles that come back over the orders by chance, and modes that two poles share.
TEST(OmaProperty, RecordsOfFewModesShowNoOther) {
  Score score;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const auto truth =
        make_ambient({.frequency = {4, 9, 17}, .channels = 4, .tones = {}, .structure = 40 + seed, .seed = 700 + seed});
    whirl::modal::OmaOptions options;
    if (seed > 6) options.method = whirl::modal::SubspaceMethod::covariance;
    add(truth, identify_operational(truth.recording, options), score);
  }
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto truth = make_ambient({.frequency = {6.2, 6.9, 12, 19, 31},
                                     .damping_low = 0.004,
                                     .damping_high = 0.03,
                                     .channels = 5,
                                     .rate = 100,
                                     .tones = {},
                                     .noise = 0.1,
                                     .structure = 60 + seed,
                                     .seed = 800 + seed});
    add(truth, identify_operational(truth.recording), score);
  }
  EXPECT_EQ(score.found, 49);
  EXPECT_LE(score.extra, 1);
  EXPECT_GE(score.frequency, 42);
  EXPECT_GE(score.damping, 42);
}

// A channel that is cut off, stands still or is full of spikes makes up to ten false modes unless it is noticed.
TEST(OmaProperty, SpoiledChannelsAreNamedAndMakeNoMode) {
  using whirl::testing::ChannelDamage;
  for (const ChannelDamage damage :
       {ChannelDamage::clipped, ChannelDamage::frozen, ChannelDamage::zeros, ChannelDamage::spikes}) {
    Score score;
    for (unsigned seed = 1; seed <= 8; ++seed) {
      auto truth =
          make_ambient({.frequency = {4, 9, 17}, .channels = 4, .tones = {}, .structure = seed, .seed = 60 + seed});
      const std::string channel = whirl::testing::spoil_channel(truth.recording, damage, seed);
      const OperationalModes found = identify_operational(truth.recording);
      add(truth, found, score);
      const auto names = [&](const std::string& w) { return w.find("channel " + channel + ":") != std::string::npos; };
      EXPECT_TRUE(std::any_of(found.summary.warnings.begin(), found.summary.warnings.end(), names))
          << static_cast<int>(damage) << " seed " << seed;
    }
    EXPECT_LE(score.extra, 1) << static_cast<int>(damage);
    EXPECT_GE(score.found, 23) << static_cast<int>(damage);
    EXPECT_GE(score.frequency, 20) << static_cast<int>(damage);
    EXPECT_GE(score.damping, 20) << static_cast<int>(damage);
  }
}

// Stated tones and bands lie within what the sample rate shows; a short record says how long it must be.
TEST(Oma, WhatTheRecordCannotShowIsRefused) {
  const auto truth = make_ambient({.frequency = {4, 9, 17}, .channels = 4, .tones = {}, .structure = 3, .seed = 5});
  const double nyquist = 0.5 / truth.recording.dt;
  const auto refused = [&](const whirl::modal::OmaOptions& options, const char* name) {
    try {
      identify_operational(truth.recording, options);
    } catch (const whirl::Error& e) {
      EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
      return;
    }
    ADD_FAILURE() << name;
  };
  for (const double tone : {0.0, -1.0, nyquist, 1e9, 1e300, static_cast<double>(INFINITY), static_cast<double>(NAN)})
    refused({.tones = {tone}}, "tone");
  for (const double f : {-1.0, 1e9, static_cast<double>(NAN)}) {
    refused({.band_low = f, .tones = {}}, "band");
    refused({.band_high = f, .tones = {}}, "band");
  }
  refused({.max_order = -1, .tones = {}}, "max_order");
  auto cut = truth.recording;
  for (auto& channel : cut.channels) channel.samples = channel.samples.head(300).eval();
  try {
    identify_operational(cut);
    ADD_FAILURE();
  } catch (const whirl::Error& e) {
    EXPECT_NE(std::string(e.what()).find("too short: 300 samples, 1240 are needed"), std::string::npos) << e.what();
  }
}

TEST(OmaProperty, SoundRecordsHaveNoWarningAndClippedOnesAreUnusable) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    auto truth =
        make_ambient({.frequency = {4, 9, 17}, .channels = 4, .tones = {}, .structure = seed, .seed = 90 + seed});
    EXPECT_TRUE(identify_operational(truth.recording).summary.warnings.empty()) << seed;
    for (whirl::Channel& c : truth.recording.channels) {
      const double limit = 0.5 * c.samples.cwiseAbs().maxCoeff();
      c.samples = c.samples.cwiseMin(limit).cwiseMax(-limit);
    }
    EXPECT_EQ(identify_operational(truth.recording).summary.status, whirl::Status::unusable) << seed;
  }
}

TEST(Oma, SetUpsAreScaledOnTheirSharedChannels) {
  const auto truth = make_ambient({.frequency = {4, 9, 17}, .channels = 8, .tones = {}, .structure = 3, .seed = 41});
  std::vector<OperationalModes> setups;
  for (const std::vector<int>& channels : {std::vector<int>{0, 1, 2, 3, 4}, {0, 1, 5, 6, 7}}) {
    whirl::Recording part;
    part.dt = truth.recording.dt;
    for (const int c : channels) {
      const auto& channel = truth.recording.channels[static_cast<std::size_t>(c)];
      part.add(channel.name, channel.quantity, channel.samples);
    }
    setups.push_back(identify_operational(part));
  }
  const OperationalModes merged = whirl::modal::merge_setups(setups);
  ASSERT_EQ(merged.modes.size(), 3u);
  ASSERT_EQ(merged.channels.size(), 8u);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(merged.modes[k].frequency.value, truth.frequency[k], 0.01 * truth.frequency[k]);
    const Eigen::VectorXcd shape = Eigen::VectorXd::Map(truth.shape[k].data(), 8).cast<std::complex<double>>();
    EXPECT_GT(whirl::modal::mac(merged.modes[k].shape, shape), 0.98);
  }
  setups[1].channels = {"a", "b", "c", "d", "e"};
  EXPECT_THROW(whirl::modal::merge_setups(setups), std::exception);
}

TEST(OmaProperty, RandomResponseAloneShowsNoTone) {
  for (unsigned seed = 51; seed <= 54; ++seed)
    EXPECT_TRUE(
        identify_operational(make_ambient({.tones = {}, .structure = 6, .seed = seed}).recording).tones.empty());
}

// The speed wanders by 4 %: no spectral line shows it, the angle does.
TEST(OmaProperty, OrdersOfAWanderingSpeedAreSubtractedByTheAngle) {
  auto truth = make_ambient({.tones = {}, .structure = 6, .seed = 61});
  const Eigen::Index n = truth.recording.size();
  Eigen::VectorXd angle(n);
  double beta = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) * truth.recording.dt;
    beta += 2 * std::numbers::pi * truth.recording.dt * 14 * (1 + 0.04 * std::sin(2 * std::numbers::pi * t / 120));
    angle[i] = beta;
  }
  for (auto& channel : truth.recording.channels) {
    const double rms = channel.samples.norm() / std::sqrt(static_cast<double>(n));
    for (Eigen::Index i = 0; i < n; ++i)
      channel.samples[i] += rms * (std::cos(angle[i] + 0.3) + 0.5 * std::sin(2 * angle[i]));
  }
  truth.recording.add("beta", whirl::Quantity::angle, angle);
  Score score, without;
  whirl::modal::OmaOptions options;
  options.orders = 2;
  const OperationalModes found = identify_operational(truth.recording, options);
  add(truth, found, score);
  add(truth, identify_operational(truth.recording), without);
  EXPECT_EQ(score.found, 8);
  EXPECT_EQ(score.extra, 0);
  // Nor are they modes where nobody names them.
  EXPECT_EQ(without.found, 8);
  EXPECT_EQ(without.extra, 0);
  ASSERT_GE(found.tones.size(), 2u);
  EXPECT_NEAR(found.tones[0].frequency, 14, 0.3);
}

}  // namespace
