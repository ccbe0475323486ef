// Driven systems of few samples a cycle whose inputs are neither held nor late: a measured force, known at the samples.
// One Runge-Kutta step a sample changes damping and frequency by so much that the search takes it for terms.
#include "whirl/testing/driven/coarse_drives.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/expr/expr.hpp"
#include "whirl/identify/second_order.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {
namespace {

IdentifiedModel identified(const testing::CoarseDrive& s, const Recording& record) {
  SindyOptions options;
  options.states = s.names;
  options.inputs = {"u"};
  return fit_sindy({record}, options);
}

/// Exactly the terms of the truth, each coefficient within five standard deviations.
void expect_truth(const testing::CoarseDrive& s, const IdentifiedModel& m) {
  ASSERT_EQ(m.equations.size(), s.truth.size());
  for (std::size_t e = 0; e < s.truth.size(); ++e) {
    std::vector<std::string> found, sought;
    for (const EquationTerm& t : m.equations[e].terms) found.push_back(expr::Expr::parse(t.function).str());
    for (const auto& [function, value] : s.truth[e]) {
      sought.push_back(expr::Expr::parse(function).str());
      for (const EquationTerm& t : m.equations[e].terms) {
        if (expr::Expr::parse(t.function).str() != sought.back()) continue;
        EXPECT_LT(std::abs(t.coefficient.value - value), 5 * t.coefficient.sd)
            << m.equations[e].lhs << ": " << function << " " << t.coefficient.value << " +- " << t.coefficient.sd;
      }
    }
    EXPECT_THAT(found, ::testing::UnorderedElementsAreArray(sought)) << m.equations[e].lhs;
  }
}

/// Largest error of a free run of another record by the noise that was added to it.
double over_noise(const IdentifiedModel& model, const Recording& other, double noise) {
  double worst = 0;
  for (const StateScore& s : score(model, other)) {
    const Eigen::VectorXd& y = other[s.state];
    worst = std::max(worst, s.rmse / (noise * std::sqrt((y.array() - y.mean()).square().mean())));
  }
  return worst;
}

struct Case {
  const char* name;
  testing::CoarseDrive (*system)(double);
  double samples_a_cycle, noise;
  bool sweep;
};

class CoarseDrivesProperty : public ::testing::TestWithParam<Case> {};

TEST_P(CoarseDrivesProperty, TermsAndCoefficientsAreThoseOfTheSystem) {
  const Case& c = GetParam();
  const testing::CoarseDrive s = c.system(c.samples_a_cycle);
  const double f0 = s.hertz / c.samples_a_cycle;
  const auto force = [&](std::uint64_t seed) {
    return c.sweep ? testing::sweep_force(0.5 * f0, 2 * f0, s.seconds, static_cast<double>(seed))
                   : testing::noise_force(0.05 * f0, 0.35 * s.hertz, 300, seed);
  };
  for (const std::uint64_t seed : {41, 42}) {
    SCOPED_TRACE(seed);
    const IdentifiedModel m = identified(s, testing::coarse_record(s, force(seed), c.noise, seed));
    expect_truth(s, m);
    EXPECT_LT(over_noise(m, testing::coarse_record(s, force(seed + 50), c.noise, seed + 50), c.noise), 1.25);
  }
}

INSTANTIATE_TEST_SUITE_P(Systems, CoarseDrivesProperty,
                         ::testing::Values(Case{"mass", testing::hard_mass, 7.5, 0.01, false},
                                           Case{"mass_clear", testing::hard_mass, 10, 0.001, false},
                                           Case{"masses_sweep", testing::two_masses, 8, 0.01, true},
                                           Case{"masses_clear", testing::two_masses, 12, 0.001, false},
                                           Case{"circuit", testing::driven_van_der_pol, 15, 0.003, true}),
                         [](const auto& i) { return std::string(i.param.name); });

// One degree of freedom from its displacement alone.
TEST(CoarseSecondOrderProperty, DampingAndSpringAreThoseOfTheMass) {
  const testing::CoarseDrive s = testing::hard_mass(7.5);
  const auto force = [&](std::uint64_t seed) { return testing::noise_force(0.5, 0.35 * s.hertz, 300, seed); };
  const IdentifiedModel m = identify_second_order(testing::coarse_record(s, force(43), 0.01, 43), {.output = "x"});
  ASSERT_EQ(m.equations.size(), 2u);
  EXPECT_NEAR(m.parameter("f0")->value, 10, 0.005);
  EXPECT_NEAR(m.parameter("zeta")->value, 0.01, 1e-4);
  for (const EquationTerm& t : m.equations[1].terms) {
    const bool own = t.function == "x" || t.function == "x'" || t.function == "x^3" || t.function == "u";
    EXPECT_TRUE(own || t.function == "1") << t.function;
    if (t.function == "x^3") {
      EXPECT_NEAR(t.coefficient.value / s.truth[1][2].second, 1, 0.01);
    }
  }
  EXPECT_LT(over_noise(m, testing::coarse_record(s, force(93), 0.01, 93), 0.01), 1.25);
}

}  // namespace
}  // namespace whirl::identification
