#include "whirl/identify/rational.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

/// x' = 0.6 - 1.5 x / (0.3 + x) from several starts (Mangan et al. 2016), noise of 1 % of the spread.
std::vector<Recording> enzyme(double noise, unsigned seed) {
  std::vector<Recording> records;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> gauss;
  for (const double start : {0.01, 0.5, 1.0, 2.0, 3.0}) {
    const Eigen::Index n = 400;
    Eigen::VectorXd y(n);
    double x = start;
    for (Eigen::Index i = 0; i < n; ++i) {
      y[i] = x;
      for (int j = 0; j < 100; ++j) {
        const auto rate = [](double v) { return 0.6 - 1.5 * v / (0.3 + v); };
        x += 1e-4 * rate(x + 0.5e-4 * rate(x));
      }
    }
    const double sd = noise * 1.0;
    for (double& v : y) v += sd * gauss(random);
    Recording r;
    r.dt = 0.01;
    r.source = "enzyme";
    r.add("x", Quantity::dimensionless, y);
    records.push_back(r);
  }
  return records;
}

class MichaelisMentenProperty : public ::testing::TestWithParam<unsigned> {};

TEST_P(MichaelisMentenProperty, ExactTermsAtOnePercent) {
  SindyOptions o;
  o.states = {"x"};
  o.library = {"1", "x", "x^2", "x^3"};
  o.equations.denominators = {"x", "x^2", "x^3"};
  const IdentifiedModel model = fit_rational(enzyme(0.01, GetParam()), o);
  ASSERT_NE(model.summary.status, Status::unusable);
  ASSERT_EQ(model.parameters.size(), 3u);
  const Estimate *one = model.parameter("x': 1"), *x = model.parameter("x': x"),
                 *below = model.parameter("x' denominator: x");
  ASSERT_TRUE(one != nullptr && x != nullptr && below != nullptr);
  EXPECT_NEAR(one->value, 0.6, 0.03);
  EXPECT_NEAR(x->value, -3, 0.2);
  EXPECT_NEAR(below->value, 1 / 0.3, 0.2);
  EXPECT_LT(model.summary.chi_square, 1.3);
}
INSTANTIATE_TEST_SUITE_P(Seeds, MichaelisMentenProperty, ::testing::Values(1u, 2u, 3u));

TEST(Rational, RefusesWhatItIsNotFor) {
  SindyOptions o;
  o.states = {"x"};
  o.library = {"1", "x"};
  o.equations.denominators = {"x"};
  o.order = 2;
  EXPECT_THROW(fit_rational(enzyme(0, 1), o), Error);
}

}  // namespace
}  // namespace whirl::identification
