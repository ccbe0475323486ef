#include "whirl/expr/library.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/expr/term_list.hpp"

namespace whirl::expr {
namespace {

std::vector<std::string> texts(const std::vector<Expr>& terms) {
  std::vector<std::string> result;
  for (const Expr& term : terms) result.push_back(term.str());
  return result;
}

TEST(Library, AListOfTermsIsSplitOutsideParentheses) {
  EXPECT_THAT(split_terms(" x*abs(x), max(x, v) ,, exp(-t)"),
              ::testing::ElementsAre("x*abs(x)", "max(x, v)", "exp(-t)"));
  EXPECT_TRUE(split_terms(" , ").empty());
}

TEST(Library, Builders) {
  EXPECT_THAT(texts(polynomial_library({"x", "y"}, 2)), ::testing::ElementsAre("1", "x", "y", "x^2", "x*y", "y^2"));
  EXPECT_EQ(polynomial_library({"a", "b", "c"}, 5).size(), 56u);  // (5 + 3)! / (5! 3!)
  EXPECT_THAT(texts(fourier_library({"X5"}, 2)),
              ::testing::ElementsAre("sin(X5)", "cos(X5)", "sin(2*X5)", "cos(2*X5)"));
  EXPECT_THAT(texts(union_library({parse_library({"x", "2*y"}), parse_library({"y", "-x", "z"})})),
              ::testing::ElementsAre("x", "2*y", "z"));
  EXPECT_THAT(texts(modal_library({{-1.5, 20.0}, {-2, 0}})),
              ::testing::ElementsAre("exp(-1.5*t)*cos(20*t)", "exp(-1.5*t)*sin(20*t)", "exp(-2*t)"));
  const Expr late = modal_library({{-1, 5}}, 2.0)[0];
  EXPECT_EQ(evaluate(late, {{"t", 1.9}}), 0);
  EXPECT_DOUBLE_EQ(evaluate(late, {{"t", 2.3}}), std::exp(-0.3) * std::cos(1.5));
  EXPECT_THROW(polynomial_library({"x"}, -1), Error);
  try {
    parse_library({"x", "y +"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("library entry 2: term \"y +\", column 4"));
  }
}

TEST(Unit, ParsesPrintsAndMultiplies) {
  for (const char* text : {"m/s^2", "1/(m^2 s^2)", "1", "kg m^2", "1/s", "V/m", "kg^0.5"})
    EXPECT_EQ(Unit::parse(text).str(), text);
  EXPECT_EQ(Unit::parse("N/kg"), Unit::parse("m/s^2"));
  EXPECT_EQ(Unit::parse("rad/s"), Unit::parse("Hz"));
  EXPECT_EQ((Unit::parse("N") / Unit::parse("m^3")).str(), "kg/(m^2 s^2)");
  for (const char* text : {"m/", "m/s/s", "m/(s", "m^", "2 m", "m/s kg", "%"})
    EXPECT_THROW(Unit::parse(text), Error) << text;
}

TEST(Unit, OfTerms) {
  const auto unit = [](const char* text) {
    const auto u = unit_of(Expr::parse(text), rotor_units());
    return u ? u->str() : "none";
  };
  EXPECT_EQ(unit("X6^2*cos(X5)"), "1/s^2");
  EXPECT_EQ(unit("X1*(X1^2 + X3^2)"), "m^3");
  EXPECT_EQ(unit("X6*abs(X6)*sgn(X6)"), "1/s^2");
  EXPECT_EQ(unit("sqrt(X1^2 + X3^2)"), "m");
  EXPECT_EQ(unit("X1 + X2"), "none");
  EXPECT_EQ(unit("sin(X1)"), "none");
  EXPECT_EQ(unit("X99"), "none");
  const auto coefficient = [](const char* term) {
    return coefficient_unit(Expr::parse(term), Unit::parse("m/s^2"), rotor_units());
  };
  EXPECT_EQ(coefficient("X1"), "1/s^2");
  EXPECT_EQ(coefficient("X1^3"), "1/(m^2 s^2)");
  EXPECT_EQ(coefficient("X6^2*cos(X5)"), "m");
}

// The groups, weighted by the parameters of a RotorModel, are its equation of motion.
TEST(LibraryReference, TiedGroupsAreTheRotorModel) {
  std::mt19937_64 rng(4);
  std::uniform_real_distribution<double> u(-1, 1);
  const CandidateLibrary library = tied_rotor_library(true, true, true);
  ASSERT_EQ(library.groups.size(), 12u);
  for (int round = 0; round < 20; ++round) {
    const std::complex<double> i(0, 1), z(u(rng), u(rng)), v(u(rng), u(rng)), eps(u(rng), u(rng)), kc(u(rng), u(rng)),
        cc(u(rng), u(rng)), d(u(rng), u(rng)), force(u(rng), u(rng));
    const double k1 = u(rng), k2 = u(rng), c = u(rng), b = u(rng), w = u(rng), a = u(rng), gain = u(rng);
    const std::complex<double> F = std::exp(i * b) * (w * w - i * a);
    const std::complex<double> acceleration =
        -k1 * z - kc * std::conj(z) - k2 * std::norm(z) * z - c * v - cc * std::conj(v) + eps * F + d + gain * force;
    const std::map<std::string, double, std::less<>> at = {
        {"X1", z.real()}, {"X2", v.real()}, {"X3", z.imag()},     {"X4", v.imag()},    {"X5", b},
        {"X6", w},        {"X7", a},        {"ux", force.real()}, {"uy", force.imag()}};
    const std::map<std::string, double> unknown = {{"k1", k1},
                                                   {"k2", k2},
                                                   {"c", c},
                                                   {"eps_re", eps.real()},
                                                   {"eps_im", eps.imag()},
                                                   {"k1_conj_re", kc.real()},
                                                   {"k1_conj_im", kc.imag()},
                                                   {"c_conj_re", cc.real()},
                                                   {"c_conj_im", cc.imag()},
                                                   {"gain", gain},
                                                   {"d_re", d.real()},
                                                   {"d_im", d.imag()}};
    double lhs[2] = {0, 0};
    for (const TiedGroup& group : library.groups) {
      for (const TiedEntry& entry : group.entries)
        lhs[entry.equation] += unknown.at(group.name) * entry.factor * evaluate(entry.function, at);
    }
    EXPECT_NEAR(lhs[0], acceleration.real(), 1e-14);
    EXPECT_NEAR(lhs[1], acceleration.imag(), 1e-14);
  }
}

}  // namespace
}  // namespace whirl::expr
