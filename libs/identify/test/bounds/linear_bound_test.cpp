#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

using ::testing::HasSubstr;

testing::ZooSystem system(const std::string& name) {
  for (testing::ZooSystem& s : testing::zoo()) {
    if (s.name == name) return s;
  }
  throw Error("no such system");
}

IdentifyOptions options_for(const testing::ZooSystem& s) {
  IdentifyOptions o;
  o.method = Method::sindy;
  o.holdout = 0;
  o.sindy.states = s.truth.states;
  o.sindy.inputs = s.truth.inputs;
  o.sindy.library = s.library;
  return o;
}

double value(const IdentifiedModel& m, const std::string& name) {
  return m.parameter(name) ? m.parameter(name)->value : 0;
}

std::string said(const IdentifiedModel& m) {
  std::string all;
  for (const std::string& w : m.summary.warnings) all += w + "; ";
  return all;
}

TEST(LinearBound, TextGivesWeightsAndLimit) {
  const LinearBound b = linear_bound("[v': x] + 2*[v': x*y^2] - 3 <= -1.5 * k + 4");
  ASSERT_EQ(b.weights.size(), 3u);
  EXPECT_EQ(b.weights[0], (std::pair<std::string, double>("v': x", 1)));
  EXPECT_EQ(b.weights[1], (std::pair<std::string, double>("v': x*y^2", 2)));
  EXPECT_EQ(b.weights[2], (std::pair<std::string, double>("k", 1.5)));
  EXPECT_DOUBLE_EQ(b.limit, 7);
  const LinearBound more = linear_bound("k >= 3 c");
  EXPECT_EQ(more.weights[0], (std::pair<std::string, double>("k", -1)));
  EXPECT_EQ(more.weights[1], (std::pair<std::string, double>("c", 3)));
  EXPECT_DOUBLE_EQ(more.limit, 0);
  for (const char* bad : {"", "k", "k < 3", "3 <= 4", "k <= ", "[k <= 3", "k c <= 3", "k ** 2 <= 1", "3 4 k <= 1",
                          "k * <= 1", "k <= 1e999", "<= 3"})
    EXPECT_THROW(linear_bound(bad), Error) << bad;
}

// Held on the boundary it asks for; the coefficients beside it move as the records ask, so that the motion is followed
// better than with the bounded coefficient moved alone; a bound that does not bind changes nothing.
TEST(LinearBoundProperty, AnActiveBoundIsHeldSaidAndTheRestFollows) {
  const testing::ZooSystem s = system("Duffing free");
  for (const std::uint64_t seed : {31, 32}) {
    const Recording r = testing::zoo_record(s, 0.01, seed);
    IdentifyOptions o = options_for(s);
    const IdentifiedModel freely = identify(r, o).model;
    ASSERT_EQ(freely.parameters.size(), 4u);
    const double sum = value(freely, "v': x") + value(freely, "v': x^3");
    o.bounds.linear = {linear_bound("[v': v] <= 0"), linear_bound("[v': x*v*x] <= 1")};
    const IdentifiedModel loose = identify(r, o).model;
    for (const auto& [name, e] : freely.parameters) EXPECT_EQ(loose.parameter(name)->value, e.value) << name;

    o.bounds.linear = {linear_bound(fmt::format("[v': x] + [v': x^3] >= {:.12g}", sum + 0.05))};
    const IdentifiedModel held = identify(r, o).model;
    EXPECT_NEAR(value(held, "v': x") + value(held, "v': x^3"), sum + 0.05, 1e-8);
    EXPECT_THAT(said(held), HasSubstr("[v': x] + [v': x^3]"));
    EXPECT_EQ(held.summary.status, Status::warning);
    IdentifiedModel naive = freely;
    for (EquationTerm& t : naive.equations[1].terms) {
      if (t.function == "x") t.coefficient.value += 0.05;
    }
    const auto error = [&](const IdentifiedModel& m) { return score(m, r).front().rmse; };
    EXPECT_LT(error(freely), error(held));
    EXPECT_LT(error(held), 0.7 * error(naive));
  }
}

// A record whose growth the linear part explains is told so; the eigenvalues of the model keep the rate.
TEST(LinearBoundProperty, TheLinearPartDecaysAsAsked) {
  for (const char* name : {"Duffing free", "linear", "Van der Pol"}) {
    SCOPED_TRACE(name);
    const testing::ZooSystem s = system(name);
    const Recording r = testing::zoo_record(s, 0.01, 33);
    IdentifyOptions o = options_for(s);
    o.bounds.least_decay = 0.15;  // 0.1 of the first two; the third is unstable at the origin
    const IdentifiedModel m = identify(r, o).model;
    Eigen::Matrix2d j = Eigen::Matrix2d::Zero();
    for (Eigen::Index e = 0; e < 2; ++e) {
      for (const EquationTerm& t : m.equations[static_cast<std::size_t>(e)].terms) {
        for (Eigen::Index k = 0; k < 2; ++k) {
          if (t.function == m.states[static_cast<std::size_t>(k)]) j(e, k) = t.coefficient.value;
        }
      }
    }
    EXPECT_LE(j.eigenvalues().real().maxCoeff(), -0.15 + 1e-6);
    EXPECT_GE(j.eigenvalues().real().maxCoeff(), -0.15 - 1e-3);  // no farther than needed
    EXPECT_THAT(said(m), HasSubstr("decay of the linear part"));
    o.bounds.least_decay = 0.05;
    const IdentifiedModel loose = identify(r, o).model;
    if (std::string(name) != "Van der Pol") {
      EXPECT_THAT(said(loose), ::testing::Not(HasSubstr("decay")));
    }
  }
}

TEST(LinearBound, LibraryGroupsKeepTheirTies) {
  const testing::ZooSystem s = system("Hopf");
  const Recording r = testing::zoo_record(s, 0.005, 34);
  expr::CandidateLibrary library;
  library.lhs = {"x'", "y'"};
  library.variables = {"x", "y"};
  const auto group = [](const char* name, std::vector<std::tuple<std::size_t, const char*, double>> entries) {
    expr::TiedGroup g;
    g.name = name;
    for (const auto& [equation, text, factor] : entries)
      g.entries.push_back({equation, expr::Expr::parse(text), factor});
    return g;
  };
  library.groups = {group("mu", {{0, "x", 1}, {1, "y", 1}}), group("w", {{0, "y", -1}, {1, "x", 1}}),
                    group("a", {{0, "x*(x^2+y^2)", -1}, {1, "y*(x^2+y^2)", -1}})};
  IdentifyOptions o;
  o.method = Method::sindy;
  o.holdout = 0;
  o.library = library;
  const IdentifiedModel freely = identify(r, o).model;
  ASSERT_NEAR(value(freely, "w"), 1, 0.02);
  o.bounds.linear = {
      linear_bound(fmt::format("a >= 2*mu + {:.12g}", value(freely, "a") - 2 * value(freely, "mu") + 0.02))};
  const IdentifiedModel held = identify(r, o).model;
  EXPECT_NEAR(value(held, "a") - 2 * value(held, "mu"), value(freely, "a") - 2 * value(freely, "mu") + 0.02, 1e-8);
  EXPECT_EQ(held.equations[0].terms[0].coefficient.value, held.equations[1].terms[0].coefficient.value);
  EXPECT_THAT(said(held), HasSubstr("a >= 2*mu"));
}

TEST(LinearBound, WhatCannotBeIsRefused) {
  const testing::ZooSystem s = system("Duffing free");
  const Recording r = testing::zoo_record(s, 0.01, 35);
  const auto refusal = [&](const std::vector<std::string>& bounds,
                           const std::function<void(IdentifyOptions&)>& change) {
    IdentifyOptions o = options_for(s);
    for (const std::string& b : bounds) o.bounds.linear.push_back(linear_bound(b));
    change(o);
    try {
      identify(r, o);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto nothing = [](IdentifyOptions&) {};
  EXPECT_THAT(refusal({"[v': z] <= 0"}, nothing), HasSubstr("v': v*x^2"));
  EXPECT_THAT(refusal({"[v': x] <= -2", "[v': x] >= -1.5"}, nothing), HasSubstr("together"));
  EXPECT_THAT(refusal({"[v': x] <= 0"}, [](IdentifyOptions& o) { o.sindy.refine = false; }), HasSubstr("refined"));
  EXPECT_THAT(refusal({"[v': x] <= 0"}, [](IdentifyOptions& o) { o.sindy.discrete = true; }), HasSubstr("refined"));
  EXPECT_THAT(refusal({"[v': x] <= 0"},
                      [](IdentifyOptions& o) {
                        o.sindy.equations.signs = {{"v'", "x", -1}};
                      }),
              HasSubstr("exclude"));
}

}  // namespace
}  // namespace whirl::identification
