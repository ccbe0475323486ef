// Sets of terms that explain a record as well as others: they are found, and said.
#include "output_error/rival_terms.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

#include "whirl/identify/sindy.hpp"
#include "whirl/testing/systems/short_decays.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

using ::testing::HasSubstr;

bool told(const IdentifiedModel& m) {
  return std::any_of(m.summary.warnings.begin(), m.summary.warnings.end(),
                     [](const std::string& w) { return w.find("cannot tell the terms") != std::string::npos; });
}

/// Rows of correlated columns, so that many sets of them are alike.
detail::TermCost alike_columns(int columns, int rows, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd a(rows, columns);
  for (int i = 0; i < rows; ++i) {
    const double common = normal(random);
    for (int j = 0; j < columns; ++j) a(i, j) = common + 0.4 * normal(random);
  }
  Eigen::VectorXd y = a.col(0) - 2 * a.col(2);
  for (double& v : y) v += normal(random);
  return {a.transpose() * a, a.transpose() * y, y.squaredNorm(), static_cast<double>(rows), {}};
}

// Against every set there is, one by one.
TEST(RivalTermsProperty, BestOfTheSetsThatLackATermIsFound) {
  constexpr int columns = 8;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u, 5u}) {
    const detail::TermCost cost = alike_columns(columns, 60, seed);
    const auto criterion = [&](const std::vector<int>& terms) {
      const Eigen::VectorXd b = cost.moment(terms);
      const double left = cost.energy - b.dot(Eigen::MatrixXd(cost.information(terms, terms)).ldlt().solve(b));
      return cost.rows * std::log(left) + static_cast<double>(terms.size()) * std::log(cost.rows);
    };
    const std::vector<int> present = {0, 2, 5};
    double best = std::numeric_limits<double>::infinity();
    std::vector<int> which;
    for (unsigned bits = 1; bits < (1u << columns); ++bits) {
      std::vector<int> terms;
      for (int j = 0; j < columns; ++j) {
        if ((bits >> j) & 1u) terms.push_back(j);
      }
      const bool within = std::includes(present.begin(), present.end(), terms.begin(), terms.end());
      const bool beyond = std::includes(terms.begin(), terms.end(), present.begin(), present.end());
      if (terms.size() > 4 || within || beyond || criterion(terms) >= best) continue;
      best = criterion(terms);
      which = terms;
    }
    const std::vector<detail::TermSet> found = detail::rival_sets(cost, present, 50);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().terms, which) << "seed " << seed;
    EXPECT_NEAR(found.front().excess, best - criterion(present), 1e-6 * std::abs(best));
  }
}

// One trajectory of a node runs along a line: v' = 24 x - 70 x^2 - 11 v x follows it as well as v' = -50 x - 15 v does.
TEST(ShortDecaysProperty, WrongTermsAreNotGivenWithoutDoubt) {
  int all = 0, right = 0, silent = 0;
  std::string which;
  for (const testing::ShortDecay& d : testing::short_decays()) {
    for (const std::uint64_t seed : {101u, 102u, 103u, 104u, 105u, 106u}) {
      SindyOptions options;
      options.states = {"x", "v"};
      const IdentifiedModel m = fit_sindy({testing::short_decay_record(d, 0.05, seed)}, options);
      bool exact = m.equations.size() == 2;
      for (std::size_t e = 0; exact && e < 2; ++e) {
        std::vector<std::string> terms;
        for (const EquationTerm& t : m.equations[e].terms) terms.push_back(t.function);
        std::sort(terms.begin(), terms.end());
        exact = terms == d.terms[e];
      }
      ++all;
      right += exact;
      if (exact || m.summary.status != Status::ok) continue;
      ++silent;
      which += fmt::format("{}, seed {}; ", d.name, seed);
    }
  }
  EXPECT_LE(silent, all / 40) << which;
  EXPECT_GE(right, all * 6 / 10);
}

TEST(ShortDecaysProperty, RivalIsNamedAndTrustIsNarrow) {
  SindyOptions options;
  options.states = {"x", "v"};
  const testing::ShortDecay d = testing::short_decays().front();
  int doubted = 0;
  for (const std::uint64_t seed : {111u, 112u, 113u, 114u, 115u, 116u}) {
    const IdentifiedModel m = fit_sindy({testing::short_decay_record(d, 0.05, seed)}, options);
    if (!told(m)) continue;
    ++doubted;
    EXPECT_EQ(m.summary.status, Status::warning);
    EXPECT_THAT(m.summary.warnings, ::testing::Contains(HasSubstr("explains them as well (chi-square ")));
    EXPECT_THAT(m.summary.trust, HasSubstr("along motions like those recorded"));
  }
  EXPECT_GE(doubted, 3);
}

// Records that tell their terms: no doubt where there is none. Two starts of the node are enough.
TEST(ShortDecaysProperty, RecordsThatTellAreNotDoubted) {
  for (const testing::ZooSystem& s : testing::zoo()) {
    SindyOptions options;
    options.states = s.truth.states;
    options.inputs = s.truth.inputs;
    options.library = s.library;
    const IdentifiedModel m = fit_sindy({testing::zoo_record(s, 0.05, 21)}, options);
    EXPECT_FALSE(told(m)) << s.name;
    EXPECT_EQ(m.summary.status, Status::ok) << s.name;
  }
  testing::ShortDecay d = testing::short_decays()[1];
  std::vector<Recording> records;
  std::uint64_t seed = 31;
  for (const testing::ShortDecay::State& start : {testing::ShortDecay::State{1, 0}, {-0.5, 8}, {0.2, -9}, {-1, 1}}) {
    d.start = start;
    records.push_back(testing::short_decay_record(d, 0.05, seed++));
  }
  SindyOptions options;
  options.states = {"x", "v"};
  const IdentifiedModel m = fit_sindy(records, options);
  EXPECT_FALSE(told(m)) << m.summary.warnings.front();
  ASSERT_EQ(m.equations[1].terms.size(), 2u);
}

// A cubic follows a pendulum of 57 degrees to a thousandth, and no further out: without noise the difference is plain.
TEST(RecordsWithoutNoiseProperty, TermsThatStandInForOthersAreSaid) {
  for (const testing::ZooSystem& s : testing::zoo()) {
    if (s.name != "pendulum") continue;
    for (const double angle : {0.8, 1.0, 2.0}) {
      testing::ZooSystem swing = s;
      swing.start = {angle, 0};
      SindyOptions options;
      options.states = s.truth.states;
      const IdentifiedModel m = fit_sindy({testing::zoo_record(swing, 0, 1)}, options);
      EXPECT_NE(m.summary.status, Status::ok) << angle;
      options.library = s.library;
      EXPECT_EQ(fit_sindy({testing::zoo_record(swing, 0, 1)}, options).summary.status, Status::ok) << angle;
    }
  }
}

}  // namespace
}  // namespace whirl::identification
