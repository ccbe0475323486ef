#include "rules/rules.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/distributions.hpp"
#include "whirl/identify/identify_rotor.hpp"

// What each threshold says of itself.
namespace whirl::identification::rules {
namespace {

double above(double chi_square, double freedom) { return chi_squared_tail(freedom, chi_square); }

TEST(Rules, EachStatesWhatItComparesAndWhereItComesFrom) {
  for (const Rule* rule : kAll) {
    EXPECT_FALSE(rule->statistic.empty());
    EXPECT_FALSE(rule->source.empty()) << rule->statistic;
    EXPECT_GT(rule->limit, 0) << rule->statistic;
    const bool known = rule->basis == Basis::law || rule->basis == Basis::counted;
    EXPECT_EQ(known, std::isfinite(rule->chance)) << rule->statistic;
    EXPECT_EQ(known, rule->tests > 0) << rule->statistic;
  }
}

TEST(Rules, TheChanceOfALawIsThatOfItsLimit) {
  for (const Rule* rule : kAll) {
    if (rule->basis != Basis::law) continue;
    // Power 0: the limit is a chance itself.
    const double chance = rule->power == 0 ? rule->limit : above(std::pow(rule->limit, rule->power), rule->freedom);
    EXPECT_NEAR(rule->chance / chance, 1, 0.01) << rule->statistic;
  }
}

TEST(Rules, NoCountedRuleRaisesMoreThanOneFalseAlarmInFifty) {
  for (const Rule* rule : kAll) {
    if (rule->basis == Basis::counted) {
      EXPECT_LE(rule->chance, 0.02) << rule->statistic;
    }
  }
}

TEST(Rules, MoreCandidatesLeaveTheChanceOfOne) {
  for (const double tests : {1.0, kUsualTests, kUsualTests + kRareTests, 48 * (kUsualTests + kRareTests)})
    EXPECT_LE(tests * above(kTerm + 2 * std::log(tests), 1), kTerm.chance * 1.01) << tests;
}

TEST(Rules, DefaultsOfOptionsAreTheRules) { EXPECT_EQ(RotorIdentifyOptions{}.score_threshold, kTerm.limit); }

}  // namespace
}  // namespace whirl::identification::rules
