#include "whirl/modal/stiffness.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"

namespace {

struct Table {
  Eigen::VectorXd d, f;
};

// F = k1 (d - d0) + k2 (d - d0)^3 + noise, deflections up and, if asked, down again with a friction force.
Table make_table(double k1, double k2, double d0, double noise, unsigned seed, bool down = false, double friction = 0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::Index n = 21;
  const Eigen::Index total = down ? 2 * n - 1 : n;
  Table t{Eigen::VectorXd(total), Eigen::VectorXd(total)};
  for (Eigen::Index i = 0; i < total; ++i) {
    const Eigen::Index at = i < n ? i : 2 * n - 2 - i;
    t.d[i] = -2e-3 + 4e-3 * static_cast<double>(at) / static_cast<double>(n - 1);
    const double u = t.d[i] - d0;
    t.f[i] = k1 * u + k2 * u * u * u + noise * normal(random) + (i < n ? friction : -friction);
  }
  return t;
}

TEST(StiffnessProperty, ExactTableGivesItsParametersBack) {
  const Table t = make_table(4e4, 2e9, 1.5e-4, 0, 1);
  const auto law = whirl::modal::fit_stiffness(t.d, t.f);
  EXPECT_NEAR(law.k1.value, 4e4, 1e-5);
  EXPECT_NEAR(law.k2.value, 2e9, 1);
  EXPECT_NEAR(law.offset.value, 1.5e-4, 1e-14);
  EXPECT_LT(law.cubic_p_value, 1e-6);
  EXPECT_EQ(law.hysteresis, 0);
}

TEST(StiffnessProperty, NinetyFivePercentIntervalsCoverTheTruth) {
  int k1 = 0, k2 = 0, offset = 0;
  const int runs = 600;
  for (int run = 0; run < runs; ++run) {
    const Table t = make_table(4e4, 2e9, -2e-4, 1.0, 100 + static_cast<unsigned>(run));
    const auto law = whirl::modal::fit_stiffness(t.d, t.f);
    k1 += law.k1.covers(4e4);
    k2 += law.k2.covers(2e9);
    offset += law.offset.covers(-2e-4);
  }
  // 600 draws at 95 %: 570 +- 5.3; four standard deviations.
  for (int hits : {k1, k2, offset}) EXPECT_NEAR(hits, 570, 22);
}

TEST(StiffnessProperty, CubicTermOfAStraightShaftIsFoundAtTheRateOfTheTest) {
  int significant = 0;
  for (unsigned run = 0; run < 400; ++run) {
    const Table t = make_table(4e4, 0, 0, 1.0, 5000 + run);
    significant += whirl::modal::fit_stiffness(t.d, t.f).cubic_p_value < 0.05;
  }
  EXPECT_NEAR(significant, 20, 18);
}

TEST(Stiffness, HysteresisIsFoundOnlyWhenItIsThere) {
  const Table clean = make_table(4e4, 2e9, 0, 0.2, 3, true);
  const auto without = whirl::modal::fit_stiffness(clean.d, clean.f);
  for (const auto& w : without.summary.warnings) EXPECT_EQ(w.find("unloading"), std::string::npos) << w;
  const Table rubbed = make_table(4e4, 2e9, 0, 0.2, 3, true, 1.5);
  const auto with = whirl::modal::fit_stiffness(rubbed.d, rubbed.f);
  EXPECT_NEAR(with.hysteresis, 3, 0.9);
  ASSERT_FALSE(with.summary.warnings.empty());
  EXPECT_NE(with.summary.warnings.back().find("unloading"), std::string::npos);
}

TEST(Stiffness, OffsetCanBeHeldAtZero) {
  const Table t = make_table(4e4, 2e9, 0, 0.5, 9);
  const auto law = whirl::modal::fit_stiffness(t.d, t.f, {.fit_offset = false});
  EXPECT_EQ(law.offset.value, 0);
  EXPECT_TRUE(std::abs(law.k1.value - 4e4) < 4 * law.k1.sd);
}

TEST(Stiffness, BadTablesAreErrors) {
  const Eigen::VectorXd d = Eigen::VectorXd::LinSpaced(5, 0, 1);
  EXPECT_THROW(whirl::modal::fit_stiffness(d, Eigen::VectorXd::Ones(4)), whirl::Error);
  EXPECT_THROW(whirl::modal::fit_stiffness(Eigen::VectorXd::Ones(9), Eigen::VectorXd::Ones(9)), whirl::Error);
  Eigen::VectorXd f = d;
  f[2] = std::nan("");
  EXPECT_THROW(whirl::modal::fit_stiffness(d, f), whirl::Error);
  const auto wrong_sign = whirl::modal::fit_stiffness(d, -d);
  EXPECT_EQ(wrong_sign.summary.status, whirl::Status::unusable);
}

// Laws that the cubic one cannot follow, 41 readings with 0.1 N of noise: each is said, and its K1 at rest lies inside
// the widened interval or the warning names what is wrong with the table.
TEST(StiffnessProperty, ATableOfAnotherLawIsSaidToBeOne) {
  constexpr double kStiff = 8500, kCubic = 1.5e7;
  const auto cubic = [](double d) { return kStiff * d + kCubic * d * d * d; };
  const std::pair<const char*, std::function<double(double)>> laws[] = {
      {"d^2", [&](double d) { return cubic(d) + 2e5 * d * d; }},
      {"d^5", [&](double d) { return cubic(d) + 1.6e12 * std::pow(d, 5); }},
      {"friction", [&](double d) { return cubic(d) + (d > 0   ? 2
                                                      : d < 0 ? -2
                                                              : 0); }},
      {"", [&](double d) { return std::abs(d) < 1e-3 ? 0 : cubic(d > 0 ? d - 1e-3 : d + 1e-3); }},  // clearance
      {"", [&](double d) { return cubic(d) + (d > 1.3e-3 ? 6 : 0); }},                              // slip
      {"limit", [&](double d) { return std::clamp(cubic(d), -30.0, 30.0); }}};
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const auto& [word, law] : laws) {
      std::mt19937_64 random(seed);
      std::normal_distribution<double> normal;
      Table t{Eigen::VectorXd::LinSpaced(41, -5e-3, 5e-3), Eigen::VectorXd(41)};
      const bool limited = std::string(word) == "limit";
      for (Eigen::Index i = 0; i < 41; ++i)
        t.f[i] = limited ? std::clamp(cubic(t.d[i]) + 0.1 * normal(random), -30.0, 30.0)
                         : law(t.d[i]) + 0.1 * normal(random);
      const auto found = whirl::modal::fit_stiffness(t.d, t.f);
      const std::string said = found.summary.warnings.empty() ? "" : found.summary.warnings.back();
      EXPECT_NE(said.find(limited ? "limit" : "does not follow"), std::string::npos) << word << " seed " << seed;
      EXPECT_NE(said.find(word), std::string::npos) << said;
      if (limited || said.find("d^") == std::string::npos) continue;
      if (std::string(word).starts_with("d^")) {
        EXPECT_TRUE(found.k1.covers(kStiff)) << word << " seed " << seed;
      }
    }
  }
}

TEST(StiffnessProperty, SoundTablesFollowTheLaw) {
  int said = 0;
  for (unsigned seed = 1; seed <= 600; ++seed) {
    const Table t = make_table(4e4, seed % 2 == 0 ? 2e9 : 0, 1e-4 * (seed % 5), 1.0, 5000 + seed, seed % 3 == 0,
                               seed % 4 == 0 ? 3.0 : 0);
    const auto law = whirl::modal::fit_stiffness(t.d, t.f);
    for (const std::string& w : law.summary.warnings) said += w.find("does not follow") != std::string::npos;
  }
  EXPECT_LE(said, 6);  // two looks of 1e-3 each: 1.2 expected
}

// A pull to one side: an offset of the force bends the table as one of the gauge does. The intervals hold what both
// readings of it say, and it is named; what needs no offset is not widened.
TEST(StiffnessProperty, AnOffsetOfTheForceIsInTheIntervalsOfAOneSidedTable) {
  constexpr double kStiff = 5e4, kCubic = 8e8;
  const auto one_sided = [](double force, double gauge, unsigned seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    Table t{Eigen::VectorXd::LinSpaced(13, 0, 3e-3), Eigen::VectorXd(13)};
    for (Eigen::Index i = 0; i < 13; ++i) {
      const double u = t.d[i] - gauge;
      t.f[i] = kStiff * u + kCubic * u * u * u + force + 0.3 * normal(random);
    }
    return whirl::modal::fit_stiffness(t.d, t.f);
  };
  const int runs = 200;
  for (const auto& [force, gauge] :
       {std::pair{8.0, 0.0}, {-8.0, 0.0}, {2.0, 0.0}, {0.3, 0.0}, {0.0, 0.0}, {0.0, 2e-4}}) {
    int k1 = 0, k2 = 0, named = 0;
    double width = 0;
    for (unsigned seed = 1; seed <= runs; ++seed) {
      const auto law = one_sided(force, gauge, seed);
      k1 += law.k1.covers(kStiff);
      k2 += law.k2.covers(kCubic);
      width += (law.k1.high - law.k1.low) / runs;
      for (const std::string& w : law.summary.warnings)
        named += w.find("zero offset of the force") != std::string::npos;
    }
    EXPECT_GE(k1, 0.92 * runs) << force << ' ' << gauge;
    EXPECT_GE(k2, 0.92 * runs) << force << ' ' << gauge;
    if (std::abs(force) > 1) {
      EXPECT_GE(named, 0.95 * runs) << force;
    }
    if (force == 0 && gauge == 0) {
      EXPECT_LE(named, 0.08 * runs);
      EXPECT_LT(width, 0.02 * kStiff);
    }
  }
}

// Readings on both sides tell the two offsets apart.
TEST(StiffnessProperty, BothSidesTellAnOffsetOfTheGaugeFromOneOfTheForce) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    const Table t = make_table(4e4, 2e9, 2e-4, 0.3, 600 + seed);
    for (const std::string& w : whirl::modal::fit_stiffness(t.d, t.f).summary.warnings)
      EXPECT_EQ(w.find("zero offset of the force"), std::string::npos) << w;
  }
}

TEST(StiffnessProperty, TensorOfAnAnisotropicShaft) {
  const double kx = 5e4, ky = 4e4, axis = 0.3;
  std::vector<whirl::modal::DirectedStiffnessTable> tables;
  for (int i = 0; i < 4; ++i) {
    const double angle = i * std::numbers::pi / 4;
    const double k = (kx + ky) / 2 + (kx - ky) / 2 * std::cos(2 * (angle - axis));
    const Table t = make_table(k, 2e9, 0, 0.3, 40 + static_cast<unsigned>(i));
    tables.push_back({angle, t.d, t.f});
  }
  const auto result = whirl::modal::fit_anisotropic_stiffness(tables);
  EXPECT_NEAR(result.mean.value, 4.5e4, 4 * result.mean.sd);
  EXPECT_NEAR(result.amplitude.value, 5e3, 4 * result.amplitude.sd);
  EXPECT_NEAR(result.axis, axis, 0.05);
  EXPECT_LT(result.p_value, 1e-6);
  EXPECT_LT(result.amplitude.sd, 300);
  tables.resize(1);
  EXPECT_THROW(whirl::modal::fit_anisotropic_stiffness(tables), whirl::Error);
}
TEST(StiffnessProperty, OneWildReadingIsNamedAndLeftOut) {
  for (unsigned seed = 7001; seed <= 7020; ++seed) {
    Table t = make_table(4e4, 2e9, 1e-4, 0.5, seed);
    const Eigen::Index at = static_cast<Eigen::Index>(seed) % 21;
    t.f[at] += (seed % 2 == 0 ? 1 : -1) * 40;
    const auto law = whirl::modal::fit_stiffness(t.d, t.f);
    EXPECT_EQ(law.points, 20) << seed;
    EXPECT_LT(law.cubic_p_value, 1e-9) << seed;
    EXPECT_NEAR(law.k2.value, 2e9, 5 * law.k2.sd) << seed;
    bool named = false;
    for (const std::string& w : law.summary.warnings)
      named = named || w.starts_with("point " + std::to_string(at + 1) + " ");
    EXPECT_TRUE(named) << seed;
  }
}

TEST(StiffnessProperty, GoodTablesLoseNoReading) {
  int lost = 0;
  for (unsigned seed = 8000; seed < 8500; ++seed)
    lost +=
        whirl::modal::fit_stiffness(make_table(4e4, 2e9, 1e-4, 1.0, seed).d, make_table(4e4, 2e9, 1e-4, 1.0, seed).f)
            .points < 21;
  EXPECT_LE(lost, 4);  // one in a thousand each
}

// A gauge with noise: least squares on the force draws K2 down by about a quarter.
TEST(StiffnessProperty, NoiseOfTheGaugeDoesNotBiasTheCubicTerm) {
  double stated = 0, plain = 0;
  const int runs = 60;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 random(9000 + static_cast<unsigned>(run));
    std::normal_distribution<double> normal;
    Table t = make_table(8500, 5e9, 0, 0.2, 9500 + static_cast<unsigned>(run), true);
    for (Eigen::Index i = 0; i < t.d.size(); ++i) t.d[i] += 2.5e-4 * normal(random);
    stated += whirl::modal::fit_stiffness(t.d, t.f, {.deflection_sd = 2.5e-4}).k2.value / runs;
    Eigen::MatrixXd a(t.d.size(), 2);
    a << t.d, t.d.array().cube().matrix();
    plain += a.colPivHouseholderQr().solve(t.f)[1] / runs;
  }
  EXPECT_LT(plain, 0.82 * 5e9);
  EXPECT_NEAR(stated, 5e9, 0.05 * 5e9);
}

}  // namespace
