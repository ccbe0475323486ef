#include "whirl/diagnosis/correction.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <random>

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

CorrectionProblem random_problem(std::mt19937& random, Index rows, Index planes) {
  std::normal_distribution<double> n;
  CorrectionProblem p;
  p.influence.resize(rows, planes);
  p.vibration.resize(rows);
  for (Index m = 0; m < rows; ++m) {
    p.vibration[m] = {n(random), n(random)};
    for (Index k = 0; k < planes; ++k) p.influence(m, k) = {n(random), n(random)};
  }
  return p;
}

// No random change of the masses within the limits goes below the certified bound, and the gap is closed.
TEST(CorrectionProperty, TheBoundHoldsAndTheGapCloses) {
  std::mt19937 random(3);
  std::normal_distribution<double> n;
  for (int trial = 0; trial < 60; ++trial) {
    CorrectionProblem p = random_problem(random, 3 + trial % 9, 1 + trial % 3);
    if (trial % 2 != 0) p.limit = Eigen::VectorXd::Constant(p.planes(), 0.3);
    if (trial % 3 == 0) p.weight = Eigen::VectorXd::LinSpaced(p.rows(), 0.5, 2);
    for (const Criterion criterion : {Criterion::min_max, Criterion::least_squares}) {
      const Correction c = solve_correction(p, criterion);
      EXPECT_LE(c.objective - c.bound, 1e-6 * c.objective + 1e-9);
      for (int change = 0; change < 200; ++change) {
        Eigen::VectorXcd w = c.masses;
        const double size = std::pow(10.0, -1 - change % 5);
        for (Index k = 0; k < p.planes(); ++k) w[k] += size * std::complex<double>(n(random), n(random));
        if (p.limit.size() > 0 && (w.cwiseAbs().array() > p.limit.array()).any()) continue;
        EXPECT_GE(objective(p, criterion, w), c.bound);
      }
    }
  }
}

// Two readings, one plane: the largest is least where both are equal, by hand.
TEST(Correction, MinMaxByHand) {
  CorrectionProblem p;
  p.influence = Eigen::MatrixXcd::Ones(2, 1);
  p.vibration = Eigen::Vector2cd(3.0, 1.0);
  const Correction c = solve_correction(p, Criterion::min_max);
  EXPECT_NEAR(c.objective, 1, 1e-6);
  EXPECT_NEAR(c.masses[0].real(), -2, 1e-5);
  EXPECT_NEAR(c.bound, 1, 1e-6);
}

TEST(Correction, AVectorBetweenTwoHolesIsSplitExactly) {
  CorrectionProblem p;
  p.influence = Eigen::MatrixXcd::Identity(1, 1);
  p.vibration = Eigen::VectorXcd::Constant(1, -std::polar(10.0, 0.5));
  Places holes{{0, std::numbers::pi / 3, 2 * std::numbers::pi / 3, std::numbers::pi}, 0, 0};
  const Placement placed =
      place_masses(p, Criterion::least_squares, Eigen::VectorXcd::Constant(1, std::polar(10.0, 0.5)), {holes});
  ASSERT_EQ(placed.masses.size(), 2U);
  EXPECT_NEAR(placed.masses[0].mass, 10 * std::sin(std::numbers::pi / 3 - 0.5) / std::sin(std::numbers::pi / 3), 1e-12);
  EXPECT_NEAR(placed.objective, 0, 1e-12);
}

// Exhaustive search over three holes and pieces is the truth.
TEST(CorrectionProperty, PiecesOnHolesAreAsGoodAsExhaustiveSearch) {
  std::mt19937 random(5);
  int best_found = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const CorrectionProblem p = random_problem(random, 3, 1);
    const double third = 2 * std::numbers::pi / 3;
    const Places holes{{0, third, 2 * third}, 0.1, 0.8};
    const Correction c = solve_correction(p, Criterion::least_squares);
    const Placement placed = place_masses(p, Criterion::least_squares, c.masses, {holes});
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 8; ++i)
      for (int j = 0; j <= 8; ++j)
        for (int k = 0; k <= 8; ++k) {
          const std::complex<double> w =
              0.1 * (double(i) + std::polar(double(j), third) + std::polar(double(k), 2 * third));
          least = std::min(least, objective(p, Criterion::least_squares, Eigen::VectorXcd::Constant(1, w)));
        }
    EXPECT_LE(placed.objective, 1.02 * least);
    best_found += placed.objective <= least * (1 + 1e-9);
    for (const PlacedMass& m : placed.masses) EXPECT_LE(m.mass, 0.8 + 1e-12);
  }
  EXPECT_GE(best_found, 38);
}

}  // namespace
}  // namespace whirl::diagnosis
