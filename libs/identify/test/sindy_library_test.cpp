#include "whirl/identify/sindy_library.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "rotor_synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

using testing::kTurn;

Recording zoo(const char* name, double noise, std::uint64_t seed) {
  for (const testing::ZooSystem& s : testing::zoo()) {
    if (s.name == name) return testing::zoo_record(s, noise, seed);
  }
  throw Error("no such system");
}

TEST(LibraryText, TermsByKindAndByName) {
  SindyOptions o;
  o.states = {"x"};
  o.inputs = {"u"};
  EXPECT_EQ(library_terms(o, {}).size(), 10u);  // monomials of two variables up to degree 3
  o.order = 2;
  EXPECT_EQ(library_terms(o, {.degree = 1}), (std::vector<std::string>{"1", "x", "x'", "u"}));
  EXPECT_EQ(library_terms(o, {.terms = {"x^3", "u"}}), (std::vector<std::string>{"x^3", "u"}));
  EXPECT_EQ(library_terms(o, {.degree = 1, .time = true, .terms = {"x^3", "u"}}),
            (std::vector<std::string>{"1", "x", "x'", "u", "t", "x^3"}));
}

TEST(LibraryText, KnownEquationsAndSigns) {
  const Equation e = known_equation("v' = -2*x + 0.1*v^3");
  EXPECT_EQ(e.lhs, "v'");
  ASSERT_EQ(e.terms.size(), 2u);
  double sum = 0;
  for (const EquationTerm& t : e.terms) {
    sum += t.coefficient.value;
    EXPECT_EQ(t.coefficient.sd, 0);
  }
  EXPECT_DOUBLE_EQ(sum, -1.9);
  EXPECT_THROW(known_equation("v'"), Error);
  const SignBound b = sign_bound("v':x^3=-");
  EXPECT_EQ(b.equation, "v'");
  EXPECT_EQ(b.function, "x^3");
  EXPECT_EQ(b.sign, -1);
  EXPECT_EQ(sign_bound("x=+").equation, "");
  for (const char* wrong : {"x", "x=2", ":x=+", "v':=+"}) EXPECT_THROW(sign_bound(wrong), Error) << wrong;
}

TEST(FitLibraryReference, TiedRotorLibraryGivesThePhysicalUnknownsOfARunDown) {
  RotorModel truth = testing::rotor_a();
  truth.eps = std::polar(2.5e-4, 0.7);
  const testing::Sweep sweep{30, 0, 12, 0.3, 1e-3};
  const Recording r = testing::recording(testing::with_noise(testing::motion(truth, sweep), 20, 3), sweep);
  const IdentifiedModel m = fit_library({r}, expr::tied_rotor_library(true));
  ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
  const double expected[] = {truth.k1, truth.k2, truth.c, truth.eps.real(), truth.eps.imag()};
  const double allowed[] = {5e-4, 0.03, 0.01, 5e-3, 5e-3};
  ASSERT_EQ(m.parameters.size(), 5u);  // no offset in the record: both constants go
  for (std::size_t j = 0; j < 5; ++j) {
    const Estimate& p = m.parameters[j].second;
    EXPECT_NEAR(p.value / expected[j], 1, allowed[j]) << m.parameters[j].first;
    EXPECT_LT(std::abs(p.value - expected[j]), 4 * p.sd) << m.parameters[j].first;
  }
  EXPECT_NEAR(m.summary.chi_square, 1, 0.1);
  EXPECT_EQ(m.parameter_covariance.size(), 25u);
  // The tie holds in the equations: -x (x^2 + y^2) in x'', -y (x^2 + y^2) in y''.
  EXPECT_EQ(m.equations[2].lhs, "x''");
  EXPECT_EQ(m.equations[2].terms[1].coefficient.value, m.equations[3].terms[1].coefficient.value);
}

TEST(FitLibrary, KnownPartsCandidatesAndTies) {
  const Recording r = zoo("Duffing free", 0.01, 4);  // x' = v, v' = -0.2 v - x... of the zoo
  // v' = known -2 x^3, unknown the rest; x' = v known as a whole.
  expr::CandidateLibrary library =
      expr::make_library({"x'", "v'"},
                         {expr::tied_group("c", {expr::Expr(0.0), expr::Expr::parse("-v")}, "c"),
                          expr::tied_group("x", {expr::Expr(0.0), expr::Expr::parse("x")}),
                          expr::tied_group("x^2", {expr::Expr(0.0), expr::Expr::parse("x^2")}),
                          expr::tied_group("v^3", {expr::Expr(0.0), expr::Expr::parse("v^3")})},
                         {expr::Expr::parse("v"), expr::Expr::parse("-2*x^3")});
  const IdentifiedModel m = fit_library({r}, library);
  ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
  SindyOptions free;
  free.states = {"x", "v"};
  const IdentifiedModel reference = fit_sindy({r}, free);
  for (const Equation& e : reference.equations) {
    if (e.lhs != "v'") continue;
    for (const EquationTerm& t : e.terms) {
      if (t.function == "v") {
        EXPECT_NEAR(m.parameter("c")->value, -t.coefficient.value, 0.01);
      }
      if (t.function == "x") {
        EXPECT_NEAR(m.parameter("x")->value, t.coefficient.value, 0.02);
      }
    }
  }
  EXPECT_EQ(m.parameter("x^2"), nullptr);
  EXPECT_EQ(m.parameter("v^3"), nullptr);
  EXPECT_EQ(m.equations[0].terms.size(), 1u);
  EXPECT_EQ(m.equations[1].terms.front().coefficient.sd, 0);
  EXPECT_NEAR(m.summary.chi_square, 1, 0.2);
}

TEST(FitLibrary, InseparableGroupsAndBadLibrariesAreTold) {
  const Recording r = zoo("Duffing free", 0.01, 4);
  const IdentifiedModel twice = fit_library(
      {r}, expr::make_library({"x'", "v'"}, {expr::tied_group("a", {expr::Expr::parse("v"), expr::Expr(0.0)}, "a"),
                                             expr::tied_group("b", {expr::Expr(0.0), expr::Expr::parse("x")}, "b"),
                                             expr::tied_group("d", {expr::Expr(0.0), expr::Expr::parse("2*x")}, "d")}));
  EXPECT_EQ(twice.summary.status, Status::unusable);
  ASSERT_FALSE(twice.summary.warnings.empty());
  EXPECT_NE(twice.summary.warnings.front().find("cannot tell b, d apart"), std::string::npos)
      << twice.summary.warnings.front();
  EXPECT_THROW(
      fit_library({r}, expr::make_library({"x'", "v''"},
                                          {expr::tied_group("a", {expr::Expr::parse("v"), expr::Expr::parse("x")})})),
      Error);
  EXPECT_THROW(fit_library({r}, expr::make_library({"x'"}, {expr::tied_group("a", {expr::Expr::parse("w")})})), Error);
}

}  // namespace
}  // namespace whirl::identification
