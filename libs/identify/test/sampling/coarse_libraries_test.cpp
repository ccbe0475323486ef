// Few samples a cycle: libraries of ties with a measured force, and equations in which time stands.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/identify/sindy.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/testing/driven/coarse_drives.hpp"

namespace whirl::identification {
namespace {

/// v' of the mass as a library of ties: the terms of the system and three that it does not have; x' = v known.
expr::CandidateLibrary mass_library() {
  std::vector<expr::TiedGroup> groups;
  for (const char* term : {"x", "v", "x^3", "u", "x^2*v", "v^3", "x^2"})
    groups.push_back(expr::tied_group(term, {expr::Expr(0.0), expr::Expr::parse(term)}));
  expr::CandidateLibrary library = expr::make_library({"x'", "v'"}, groups, {expr::Expr::parse("v"), expr::Expr(0.0)});
  return library;
}

// One step a sample left the damping of the mass tens of standard deviations off, and took false terms.
TEST(CoarseLibrariesProperty, TiedTermsOfADrivenMassAreThoseOfTheSystem) {
  for (const auto& [cycle, noise] : {std::pair{8.0, 0.01}, {8.0, 0.003}}) {
    const testing::CoarseDrive s = testing::hard_mass(cycle);
    const double share = noise;
    const auto record = [&](std::uint64_t seed) {
      return testing::coarse_record(s, testing::noise_force(0.5, 0.35 * s.hertz, 300, seed), share, seed);
    };
    const IdentifiedModel m = fit_library({record(71)}, mass_library());
    SCOPED_TRACE(noise);
    ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
    EXPECT_EQ(m.parameters.size(), s.truth[1].size());
    for (const auto& [function, value] : s.truth[1]) {
      const Estimate* p = m.parameter(function);
      ASSERT_NE(p, nullptr) << function;
      EXPECT_LT(std::abs(p->value - value), 5 * p->sd) << function << " " << p->value << " +- " << p->sd;
    }
    EXPECT_LT(m.summary.chi_square, 1.2);
    const Recording other = record(171);
    for (const StateScore& score_of : score(m, other)) {
      const Eigen::VectorXd& y = other[score_of.state];
      EXPECT_LT(score_of.rmse, 1.3 * noise * std::sqrt((y.array() - y.mean()).square().mean())) << score_of.state;
    }
  }
}

// A force that is a function of time: x'' = -k x - c x' + a cos(5 t).
TEST(CoarseLibrariesProperty, EquationsInTimeTakeTheStepsTheyNeed) {
  testing::CoarseDrive s;
  s.names = {"x", "v"};
  s.hertz = 8;
  s.seconds = 120;
  s.rate = [](const double* x, double u, double* rate) {
    rate[0] = x[1];
    rate[1] = -40 * x[0] - 0.3 * x[1] - 20 * x[0] * x[0] * x[0] + 6 * u;
  };
  for (const double noise : {0.01, 0.001}) {
    const Recording r = testing::coarse_record(
        s, [](double t) { return std::cos(5 * t); }, noise, 75);
    SindyOptions options;
    options.states = {"x", "v"};
    options.library = {"x", "v", "x^3", "x^2*v", "x*v^2", "v^3", "cos(5*t)", "sin(5*t)"};
    const IdentifiedModel m = fit_sindy({r}, options);
    SCOPED_TRACE(noise);
    ASSERT_EQ(m.equations.size(), 2u);
    ASSERT_EQ(m.equations[0].terms.size(), 1u);
    EXPECT_EQ(m.equations[1].terms.size(), 4u);
    for (const EquationTerm& t : m.equations[1].terms) {
      const double truth = t.function == "x"               ? -40
                           : t.function == "v"             ? -0.3
                           : t.function == "x^3"           ? -20
                           : t.function.starts_with("cos") ? 6
                                                           : 0;
      EXPECT_LT(std::abs(t.coefficient.value - truth), 5 * t.coefficient.sd)
          << t.function << " " << t.coefficient.value << " +- " << t.coefficient.sd;
    }
    for (const StateScore& score_of : score(m, r)) EXPECT_LT(score_of.rmse, 1.3 * score_of.noise) << score_of.state;
  }
}

}  // namespace
}  // namespace whirl::identification
