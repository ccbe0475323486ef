// Blows that disagree with the others: named, and left out when most agree.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "whirl/modal/frf.hpp"

namespace {

using whirl::Quantity;
using whirl::Recording;

// Blows of half-sine pulses on three modes, each response the sum of decaying oscillations that every sample of the
// force starts (recursion of the exact impulse response), with noise.
std::vector<Recording> blows(unsigned seed, int count = 5) {
  std::mt19937_64 random(seed * 7919ull);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const double dt = 1.0 / 2048;
  const Eigen::Index n = 2048, start = 60;
  std::vector<Recording> result;
  for (int b = 0; b < count; ++b) {
    Eigen::VectorXd force = Eigen::VectorXd::Zero(n), response = Eigen::VectorXd::Zero(n);
    const double peak = 60 * (0.7 + 0.6 * uniform(random));
    const auto width = static_cast<Eigen::Index>(5 + 3 * uniform(random));
    for (Eigen::Index i = 0; i < width; ++i)
      force[start + i] =
          peak * std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(width));
    for (const double f : {31.0, 84.0, 143.0}) {
      const double w = 2 * std::numbers::pi * f, zeta = 0.02;
      std::complex<double> z = 0;
      const std::complex<double> turn = std::exp(std::complex<double>(-zeta * w, w) * dt);
      for (Eigen::Index i = 0; i < n; ++i) {
        z = z * turn + force[i] * dt;
        response[i] += w * z.imag() / 30;
      }
    }
    const double size = std::sqrt(response.squaredNorm() / static_cast<double>(n));
    for (Eigen::Index i = 0; i < n; ++i) {
      force[i] += 0.002 * peak * normal(random);
      response[i] += 0.03 * size * normal(random);
    }
    Recording record;
    record.dt = dt;
    record.source = "blow";
    record.add("f", Quantity::force, force);
    record.add("a", Quantity::acceleration, response);
    result.push_back(std::move(record));
  }
  return result;
}

std::vector<whirl::modal::BlowReport> judge(const std::vector<Recording>& records,
                                            whirl::modal::FrfOptions options = {}) {
  std::vector<whirl::modal::BlowReport> reports;
  whirl::modal::estimate_frf(records, options, &reports);
  return reports;
}

void expect_only_third(const std::vector<whirl::modal::BlowReport>& reports, const std::string& word) {
  for (std::size_t i = 0; i < reports.size(); ++i) {
    EXPECT_EQ(reports[i].used, i != 2) << "blow " << i + 1;
    EXPECT_EQ(reports[i].disagreements.empty(), i != 2) << "blow " << i + 1;
  }
  ASSERT_FALSE(reports[2].disagreements.empty());
  EXPECT_NE(reports[2].disagreements[0].find(word), std::string::npos) << reports[2].disagreements[0];
}

TEST(BlowAgreementProperty, ReversedScaledDelayedAndStrangeBlowsAreNamedAndLeftOut) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto clean = blows(seed);
    auto damaged = clean;
    damaged[2].channels[1].samples *= -1;
    expect_only_third(judge(damaged), "reversed");
    damaged = clean;
    damaged[2].channels[1].samples /= 9.80665;
    expect_only_third(judge(damaged), "in g");
    damaged = clean;
    damaged[2].channels[1].samples.tail(2042) = clean[2].channels[1].samples.head(2042).eval();
    expect_only_third(judge(damaged), "late by");
    damaged = clean;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (double& x : damaged[2].channels[1].samples) x = 5 * normal(random);
    expect_only_third(judge(damaged), "incoherent");
  }
}

TEST(BlowAgreementProperty, CleanSetsAreNotAccused) {
  int accused = 0, all = 0;
  for (unsigned seed = 101; seed <= 180; ++seed) {
    for (const auto& report : judge(blows(seed))) {
      ++all;
      accused += !report.disagreements.empty();
    }
  }
  EXPECT_LT(accused, 0.01 * all);
}

TEST(BlowAgreement, ExcludedBlowsAreNotAveraged) {
  const auto reports = judge(blows(7), {.exclude = {.blows = {2, 4}}});
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(reports[i].used, i != 1 && i != 3);
  EXPECT_THROW(judge(blows(7), {.exclude = {.blows = {6}}}), std::exception);
}

TEST(BlowAgreement, OddBlowsAreKeptWhenAsked) {
  auto damaged = blows(8);
  damaged[2].channels[1].samples *= -1;
  const auto reports = judge(damaged, {.exclude = {.odd = false}});
  EXPECT_TRUE(reports[2].used);
  EXPECT_FALSE(reports[2].disagreements.empty());
}

TEST(BlowAgreement, TwoBlowsThatDisagreeAreBothNamedAndKept) {
  auto damaged = blows(9, 2);
  damaged[1].channels[1].samples *= -1;
  for (const auto& report : judge(damaged)) {
    EXPECT_TRUE(report.used);
    EXPECT_FALSE(report.disagreements.empty());
  }
}

TEST(BlowAgreement, DeadResponseIsLeftOutWithAWarning) {
  auto records = blows(10);
  for (Recording& record : records) record.add("dead", Quantity::acceleration, Eigen::VectorXd::Zero(record.size()));
  const auto frf = whirl::modal::estimate_frf(records);
  ASSERT_EQ(frf.channels.size(), 1u);
  EXPECT_NE(frf.summary.warnings.front().find("dead"), std::string::npos);
}

// A response of the third blow holds its value, or reads 0, for 3 to 20 % of the record from shortly after the blow on:
// with the pulse of 2 s and 3 % noise neither the signs nor the gains of the blows tell.
TEST(BlowDamageProperty, BlowWithAResponseThatStandsStillIsNamedAndLeftOut) {
  int named = 0, left_out = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::vector<Recording> records = blows(500 + seed);
    std::mt19937_64 random(seed * 104729ull);
    Eigen::VectorXd& a = records[2].channels[1].samples;
    const auto first = static_cast<Eigen::Index>(70 + random() % 500),
               length = static_cast<Eigen::Index>(60 + random() % 340);
    a.segment(first, length).setConstant(seed % 2 == 0 ? 0 : a[first]);
    const auto reports = judge(records);
    named +=
        !reports[2].damage.empty() && reports[2].damage[0].find(seed % 2 == 0 ? "a reads 0" : "a stands still") == 0;
    left_out += !reports[2].used;
    for (const std::size_t other : {0, 1, 3, 4}) EXPECT_TRUE(reports[other].damage.empty()) << seed;
  }
  EXPECT_EQ(named, 40);
  EXPECT_EQ(left_out, 40);
}

// The same readings from a converter of 12 to 16 bits, of blows that ring down to its last bit.
TEST(BlowDamageProperty, SoundBlowsAreNotAccused) {
  for (unsigned seed = 1; seed <= 80; ++seed) {
    std::vector<Recording> records = blows(900 + seed);
    for (Recording& record : records) {
      for (whirl::Channel& c : record.channels) {
        const double bit = 4 * c.samples.cwiseAbs().maxCoeff() / std::pow(2.0, 12 + seed % 5);
        c.samples = bit * (c.samples / bit).array().round();
      }
    }
    for (const auto& report : judge(records)) EXPECT_TRUE(report.damage.empty()) << seed << " " << report.damage[0];
  }
}

// Single wild samples of a response, or of the force far from its pulse (before it, after it, higher than it): named,
// with `repair` bridged, and the FRF is that of the sound blows. They were averaged without a word, and a spike of the
// force cut its record short.
TEST(BlowDamageProperty, SpikesAreNamedAndBridged) {
  int named = 0, close = 0, kept = 0, all = 0;
  for (unsigned seed = 500; seed < 540; ++seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const std::vector<Recording> sound = blows(seed);
    std::vector<Recording> records = sound;
    const bool force = seed % 2 == 1;
    Eigen::VectorXd& hit = records[seed % 5].channels[force ? 0 : 1].samples;
    const double top = hit.cwiseAbs().maxCoeff();
    for (int k = 0; k < (force ? 1 : 3); ++k) {
      const bool before = force && uniform(random) < 0.3;
      const auto at = before ? static_cast<Eigen::Index>(5 + 30 * uniform(random))
                             : static_cast<Eigen::Index>(200 + 1500 * uniform(random));
      hit[at] += top * (uniform(random) < 0.5 ? 1 : -1) * (0.4 + 1.2 * uniform(random));
    }
    const whirl::FrequencyResponse want = whirl::modal::estimate_frf(sound),
                                   got = whirl::modal::estimate_frf(records, {.repair = true});
    ++all;
    kept += whirl::modal::estimate_frf(records).averages == 5;
    const bool told = !got.summary.warnings.empty() && got.summary.warnings[0].find("spike") != std::string::npos;
    named += told;
    const Eigen::Index lines = std::min(want.frequency.size(), got.frequency.size());
    const Eigen::VectorXcd a = want.channels[0].value.head(lines), b = got.channels[0].value.head(lines);
    close += got.averages == 5 && lines > 100 && (a - b).norm() < 0.02 * a.norm();
  }
  EXPECT_GE(named, all - 2);
  EXPECT_GE(close, all - 2);
  EXPECT_GE(kept, all - 2);  // reported alone, no blow is lost
}

TEST(BlowDamage, OneBlowAloneIsRefusedByName) {
  std::vector<Recording> records = blows(3, 1);
  records[0].channels[1].samples.segment(100, 200).setZero();
  try {
    judge(records);
    FAIL();
  } catch (const std::exception& e) {
    EXPECT_NE(std::string(e.what()).find("a reads 0"), std::string::npos) << e.what();
  }
  EXPECT_EQ(judge(records, {.exclude = {.overloads = false}})[0].damage.size(), 1u);
}

}  // namespace
