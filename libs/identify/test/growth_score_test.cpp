#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <functional>
#include <numbers>
#include <random>

#include "growth/rotor_candidates.hpp"
#include "output_error/score.hpp"
#include "terms/catalogue.hpp"

namespace whirl::identification::detail {
namespace {

// A term is kept by its name while others are taken up: the name must go on to mean the same mode.
TEST(RotorCandidates, ANameOfAModeHoldsWhenAnotherIsTaken) {
  Growth g;
  for (const double hz : {10.0, 10.4, 30.0, 60.0}) g.modes.push_back({{2 * std::numbers::pi * hz, 0.02, 0}, true});
  for (const double hz : {10.0, 60.0}) g.decays.push_back({{2 * std::numbers::pi * hz, 0.02}});
  const Growth one = with_term(with_term(g, {&terms::mode(), 1}, true), {&terms::decay(), 1}, true);
  EXPECT_EQ(label({&terms::mode(), 4}, one), "mode 60 Hz");
  EXPECT_EQ(label({&terms::decay(), 2}, one), "decay 60 Hz");
  EXPECT_FALSE(one.modes[0].open || one.modes[1].open) << "the taken one and its neighbour";
  EXPECT_TRUE(one.modes[2].open && one.modes[3].open);
  const Growth two = with_term(with_term(one, {&terms::mode(), 4}, true), {&terms::decay(), 2}, true);
  ASSERT_EQ(two.start.modes.size(), 2U);
  EXPECT_DOUBLE_EQ(two.start.modes[1].omega, 2 * std::numbers::pi * 60);
  EXPECT_DOUBLE_EQ(two.active.modes.decays[1].omega, 2 * std::numbers::pi * 60);
}

/// Whether a rare term is tried beside a usual one, by their scores.
bool rare_is_tried(double usual, double rare, const std::vector<TermId>& refused = {}) {
  constexpr double kThreshold = 16;
  std::vector<ScoreCandidate> by_score{{&terms::quintic_stiffness(), 0, usual}, {&terms::quadratic_springs(), 0, rare}};
  std::ranges::sort(by_score, std::greater{}, &ScoreCandidate::score);
  const std::vector<TermId> tried =
      next_terms(by_score, Growth{}, refused, kThreshold, false, false, lead_over_usual(by_score, refused, kThreshold));
  return std::ranges::find(tried, TermId{&terms::quadratic_springs()}) != tried.end();
}

TEST(RotorCandidates, ARareTermIsTriedBesideUsualOnesOnlyWhereItLeads) {
  EXPECT_FALSE(rare_is_tried(100, 199)) << "less than twice the usual one";
  EXPECT_TRUE(rare_is_tried(100, 201));
  EXPECT_FALSE(rare_is_tried(1, 47)) << "below the level of what is chosen among all";
  EXPECT_TRUE(rare_is_tried(1, 49));
  EXPECT_TRUE(rare_is_tried(100, 101, {{&terms::quintic_stiffness()}})) << "the usual one was tried and refused";
  EXPECT_FALSE(rare_is_tried(100, 300, {{&terms::quadratic_springs()}})) << "refused itself";
}

/// Columns and a residual of white noise, drawn with a seed.
struct Drawn {
  Eigen::MatrixXd active, candidate;
  Eigen::VectorXd residual;
  Eigen::MatrixXd basis() const {
    return Eigen::HouseholderQR<Eigen::MatrixXd>(active).householderQ() *
           Eigen::MatrixXd::Identity(active.rows(), active.cols());
  }
};
Drawn drawn(unsigned seed, Eigen::Index rows, Eigen::Index unknowns) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto fill = [&](Eigen::Index columns) {
    return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&](auto, auto) { return normal(random); }));
  };
  Drawn d{fill(3), fill(unknowns), fill(1)};
  d.candidate += 0.8 * d.active.leftCols(1).replicate(1, unknowns);  // partly explained by the model
  const Eigen::MatrixXd q = d.basis();
  d.residual -= q * (q.transpose() * d.residual);  // as a fit leaves it
  return d;
}

TEST(GrowthScoreProperty, RowsAndSumsGiveTheSameEvidence) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Drawn d = drawn(seed, 200, 2);
    const Evidence rows = evidence(remainder(d.basis(), d.candidate, d.residual), 1);
    Eigen::MatrixXd all(200, 5);
    all << d.active, d.candidate;
    const Evidence sums =
        evidence(remainders(all.transpose() * all, all.transpose() * d.residual, {0, 1, 2}, {{3, 4}}).front(), 1);
    EXPECT_NEAR(rows.score, sums.score, 1e-9 * rows.score);
    EXPECT_LT((rows.coefficient - sums.coefficient).norm(), 1e-9);
  }
}

TEST(GrowthScoreProperty, ScoreIsTheFallOfTheSumOfSquares) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Drawn d = drawn(seed, 100, 1);
    Eigen::MatrixXd all(100, 4);
    all << d.active, d.candidate;
    const double fall =
        d.residual.squaredNorm() - (d.residual - all * all.colPivHouseholderQr().solve(d.residual)).squaredNorm();
    const Evidence e = evidence(remainder(d.basis(), d.candidate, d.residual), 2);
    EXPECT_NEAR(e.score, fall / 2, 1e-9);
    EXPECT_NEAR(e.coefficient[0], all.colPivHouseholderQr().solve(d.residual)[3], 1e-9);
    EXPECT_NEAR(std::pow(e.coefficient[0] / e.sd, 2), e.score, 1e-9);
  }
}

// The threshold of 16 is four sigma whatever the number of unknowns: false alarms stay as rare.
TEST(GrowthScoreProperty, NoTermOfOneToFourUnknownsPassesOnNoiseMoreOftenThanThreeSigmaAllows) {
  for (const int unknowns : {1, 2, 4}) {
    int above = 0;
    for (unsigned seed = 1; seed <= 2000; ++seed) {
      const Drawn d = drawn(1000 * static_cast<unsigned>(unknowns) + seed, 40, unknowns);
      above += evidence(remainder(d.basis(), d.candidate, d.residual), 1).score > 16;
    }
    EXPECT_LE(above, 5) << unknowns;  // four sigma: 0.13 expected
  }
}

TEST(GrowthScore, FindsNothingInWhatTheModelExplains) {
  Drawn d = drawn(3, 100, 2);
  d.candidate.col(0) = d.active.col(0) - d.active.col(2);
  d.candidate.col(1) = 3 * d.active.col(1);
  EXPECT_EQ(evidence(remainder(d.basis(), d.candidate, d.residual), 1).score, 0);
}

TEST(GrowthScore, CountsADirectionOnce) {
  Drawn d = drawn(4, 100, 1);
  const Evidence one = evidence(remainder(d.basis(), d.candidate, d.residual), 1);
  const Eigen::MatrixXd twice = d.candidate.replicate(1, 2);
  EXPECT_NEAR(evidence(remainder(d.basis(), twice, d.residual), 1).score, one.score, 1e-6 * one.score + 1e-9);
}

}  // namespace
}  // namespace whirl::identification::detail
