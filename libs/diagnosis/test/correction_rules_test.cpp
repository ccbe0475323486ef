#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "whirl/core/error.hpp"
#include "whirl/diagnosis/correction.hpp"

namespace whirl::diagnosis {
namespace {

using C = std::complex<double>;

/// One plane, two probes that it moves alike; vibrations of micrometres, as they are.
CorrectionProblem one_plane(double scale) {
  CorrectionProblem p;
  p.influence = Eigen::MatrixXcd::Constant(2, 1, scale * C(0, 1));
  p.vibration.resize(2);
  p.vibration << scale * C(1, 0), scale * C(4, 0);
  return p;
}

TEST(CorrectionRules, LeastSquaresAndTheSmallestMaximumAreToldApartAtAnyScale) {
  for (const double scale : {1e-9, 1e-6, 1.0, 1e6}) {
    const CorrectionProblem p = one_plane(scale);
    const Correction squares = solve_correction(p, Criterion::least_squares);
    EXPECT_NEAR(std::abs(squares.masses[0] - C(0, 2.5)), 0, 1e-9);
    EXPECT_NEAR(squares.objective, scale * std::hypot(1.5, 1.5), 1e-9 * scale);
    EXPECT_DOUBLE_EQ(squares.bound, squares.objective) << "nothing is below the optimum, and it is not zero";
    CorrectionProblem three = p;
    three.influence = Eigen::MatrixXcd::Constant(3, 1, scale * C(0, 1));
    three.vibration.resize(3);
    three.vibration << scale * C(1, 0), scale * C(1, 0), scale * C(4, 0);
    const Correction most = solve_correction(three, Criterion::min_max);
    EXPECT_NEAR(std::abs(most.masses[0] - C(0, 2.5)), 0, 1e-4);
    EXPECT_NEAR(most.objective, 1.5 * scale, 1e-4 * scale);
    three.vibration.setConstant(scale * C(3, 0));
    const Correction exact = solve_correction(three, Criterion::min_max);
    EXPECT_EQ(exact.bound, 0);
    EXPECT_NEAR(exact.objective, 0, 1e-12 * scale);
  }
}

TEST(CorrectionRules, TheMassTakesTheVibrationAway) {
  // 3 um at 30 degrees, 0.5 um per gram at 70 degrees: 6 g opposite to the heavy spot.
  CorrectionProblem p;
  p.influence = Eigen::MatrixXcd::Constant(1, 1, std::polar(0.5, 70 * M_PI / 180));
  p.vibration = Eigen::VectorXcd::Constant(1, std::polar(3.0, 30 * M_PI / 180));
  const Correction c = solve_correction(p, Criterion::least_squares);
  EXPECT_NEAR(std::abs(c.masses[0] - std::polar(6.0, (180 + 30 - 70) * M_PI / 180)), 0, 1e-9);
  EXPECT_NEAR(c.residual.norm(), 0, 1e-12);
  EXPECT_FALSE(c.limited);
}

TEST(CorrectionRules, ALimitHoldsAPlaneAndMayBeZero) {
  CorrectionProblem p = one_plane(1e-6);
  p.limit = Eigen::VectorXd::Constant(1, 1.0);
  const Correction held = solve_correction(p, Criterion::least_squares);
  EXPECT_TRUE(held.limited);
  EXPECT_NEAR(std::abs(held.masses[0]), 1, 1e-4);
  EXPECT_LE(held.bound, held.objective);
  p.limit[0] = 0;
  EXPECT_NO_THROW(p.check());
  p.limit[0] = -1e-9;
  EXPECT_THROW(p.check(), Error);
  p.limit[0] = std::nan("");
  EXPECT_THROW(p.check(), Error);
  p.limit[0] = 2.6;
  EXPECT_FALSE(solve_correction(p, Criterion::least_squares).limited);
}

TEST(CorrectionRules, WeightsCountAndMustNotAllBeZero) {
  CorrectionProblem p = one_plane(1);
  p.weight = Eigen::Vector2d(1, 0);
  EXPECT_NEAR(std::abs(solve_correction(p, Criterion::least_squares).masses[0] - C(0, 1)), 0, 1e-9);
  p.weight.setZero();
  EXPECT_THROW(p.check(), Error);
  p.weight = Eigen::Vector2d(1, -1);
  EXPECT_THROW(p.check(), Error);
}

TEST(CorrectionRules, PlanesAreTakenByWhatTheyAdd) {
  Eigen::MatrixXcd influence(3, 3);
  // The second is the strongest; the third is half of it and a little of its own; the first is its own direction.
  influence << C(1, 0), C(0, 0), C(0, 0),  //
      C(0, 0), C(0, 4), C(0, 2),           //
      C(0, 0), C(0, 0), C(0.3, 0);
  const PlaneIndependence r = plane_independence(influence);
  EXPECT_EQ(r.order, (std::vector<int>{1, 0, 2}));
  EXPECT_NEAR(r.significance[0], 1, 1e-12);
  EXPECT_NEAR(r.significance[1], 1, 1e-12);
  EXPECT_NEAR(r.significance[2], 0.3 / std::hypot(2, 0.3), 1e-12);
  EXPECT_EQ(r.twin, (std::vector<int>{1, -1, 1}));
  EXPECT_EQ(r.independent(), (std::vector<int>{0, 1}));
  EXPECT_EQ(r.independent(r.significance[2]), (std::vector<int>{0, 1, 2})) << "the tolerance itself is enough";
  influence.col(2) = 2.0 * influence.col(1);
  const PlaneIndependence same = plane_independence(influence);
  EXPECT_EQ(same.order, (std::vector<int>{2, 0, 1}));
  EXPECT_NEAR(same.significance[1], 0, 1e-12);
  influence.col(0).setZero();
  EXPECT_EQ(plane_independence(influence).significance[0], 0);
}

TEST(CorrectionRules, APlaneIsLikeTheOneOfItsDirectionHoweverLargeOthersAre) {
  Eigen::MatrixXcd influence(2, 3);
  influence << C(10, 0), C(0, 0), C(1, 0), C(0, 0), C(5, 0), C(2, 0);
  EXPECT_EQ(plane_independence(influence).twin, (std::vector<int>{-1, 0, 1}));
}

TEST(CorrectionRules, AWrongWeightIsNamedByItsRow) {
  CorrectionProblem p = one_plane(1);
  p.weight = Eigen::Vector2d(1, -1);
  try {
    solve_correction(p, Criterion::least_squares);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("weight of row 2"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace whirl::diagnosis
