#include "whirl/identify/sindy.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

/// Functions of an equation, canonical and sorted.
std::vector<std::string> support(const IdentifiedModel& m, const std::string& lhs) {
  std::vector<std::string> s;
  for (const Equation& e : m.equations) {
    if (e.lhs != lhs) continue;
    for (const EquationTerm& t : e.terms) s.push_back(expr::Expr::parse(t.function).str());
  }
  std::sort(s.begin(), s.end());
  return s;
}
double coefficient(const IdentifiedModel& m, const std::string& lhs, const std::string& function) {
  const expr::Expr f = expr::Expr::parse(function);
  for (const Equation& e : m.equations) {
    for (const EquationTerm& t : e.terms) {
      if (e.lhs == lhs && expr::Expr::parse(t.function) == f) return t.coefficient.value;
    }
  }
  return std::nan("");
}
SindyOptions options_for(const testing::ZooSystem& s) {
  SindyOptions o;
  o.states = s.truth.states;
  o.inputs = s.truth.inputs;
  o.library = s.library;
  return o;
}
testing::ZooSystem system(const std::string& name) {
  for (testing::ZooSystem& s : testing::zoo()) {
    if (s.name == name) return s;
  }
  throw Error("no such system");
}

class CanonicalSystemsReference : public ::testing::TestWithParam<int> {};

TEST_P(CanonicalSystemsReference, DefaultSettingsFindTheExactSupport) {
  const testing::ZooSystem s = testing::zoo()[static_cast<std::size_t>(GetParam())];
  SCOPED_TRACE(s.name);
  for (double noise : {0.0, 0.05}) {
    const IdentifiedModel m = fit_sindy({testing::zoo_record(s, noise, 1)}, options_for(s));
    for (const Equation& truth : s.truth.equations) {
      EXPECT_EQ(support(m, truth.lhs), support(s.truth, truth.lhs)) << "noise " << noise;
      for (const EquationTerm& t : truth.terms) {
        const double error = coefficient(m, truth.lhs, t.function) / t.coefficient.value - 1;
        EXPECT_LT(std::abs(error), noise == 0 ? 1e-5 : 0.05) << truth.lhs << " " << t.function << ", noise " << noise;
      }
    }
    if (noise > 0) {
      EXPECT_NEAR(m.summary.chi_square, 1, 0.2);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Zoo, CanonicalSystemsReference, ::testing::Range(0, 11));

TEST(FitSindyProperty, TrueCoefficientsLieInsideTheirIntervals) {
  const testing::ZooSystem s = system("Van der Pol");
  int inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const IdentifiedModel m = fit_sindy({testing::zoo_record(s, 0.02, seed)}, options_for(s));
    for (const Equation& truth : s.truth.equations) {
      for (const EquationTerm& t : truth.terms) {
        for (const Equation& e : m.equations) {
          for (const EquationTerm& found : e.terms) {
            if (e.lhs != truth.lhs || !(expr::Expr::parse(found.function) == expr::Expr::parse(t.function))) continue;
            ++all;
            inside += found.coefficient.covers(t.coefficient.value);
          }
        }
      }
    }
  }
  EXPECT_EQ(all, 40);
  EXPECT_GE(inside, 33);  // 95 % of 40 is 38; binomial 0.1 % point is 33
}

TEST(FitSindyProperty, UnitsOfStatesAndTimeDoNotMatter) {
  // x = 1e-5 X, v = 1e2 V, t = 1e-3 T: coefficients of very different size, the same support.
  const testing::ZooSystem s = system("Duffing free");
  Recording r = testing::zoo_record(s, 0.01, 5);
  const IdentifiedModel plain = fit_sindy({r}, options_for(s));
  r.dt *= 1e-3;
  r.channels[0].samples *= 1e-5;
  r.channels[1].samples *= 1e2;
  const IdentifiedModel scaled = fit_sindy({r}, options_for(s));
  EXPECT_EQ(support(scaled, "x'"), support(plain, "x'"));
  EXPECT_EQ(support(scaled, "v'"), support(plain, "v'"));
  // v' / (1e2 / 1e-3) = -2 (x / 1e-5)^3
  EXPECT_NEAR(coefficient(scaled, "v'", "x^3") / (coefficient(plain, "v'", "x^3") * 1e20), 1, 1e-3);
}

TEST(FitSindy, DisplacementAloneGivesTheSecondOrderEquation) {
  const testing::ZooSystem s = system("Duffing forced");
  Recording r = testing::zoo_record(s, 0.01, 3);
  SindyOptions o;
  o.states = {"x"};
  o.inputs = {"u"};
  o.order = 2;
  const IdentifiedModel m = fit_sindy({r}, o);
  EXPECT_EQ(m.states, (std::vector<std::string>{"x", "x'"}));
  EXPECT_EQ(support(m, "x''"), (std::vector<std::string>{"u", "x", "x'", "x^3"}));
  EXPECT_NEAR(coefficient(m, "x''", "x^3"), -1, 0.01);
  EXPECT_NEAR(coefficient(m, "x''", "x'"), -0.3, 0.01);
  const std::vector<StateScore> fit = score(m, r, 5.0);
  ASSERT_EQ(fit.size(), 1u);  // x; its rate is not measured
  EXPECT_LT(fit[0].nrmse, 0.2);
}

TEST(FitSindy, KnownEquationsGapsAndSeveralRecords) {
  const testing::ZooSystem s = system("Duffing free");
  Recording first = testing::zoo_record(s, 0.01, 4), second = first;
  for (Channel& c : first.channels) {
    c.samples.segment(400, 7).setConstant(std::numeric_limits<double>::quiet_NaN());
    c.samples = c.samples.head(1000).eval();
  }
  for (Channel& c : second.channels) c.samples = c.samples.tail(900).eval();
  SindyOptions o = options_for(s);
  o.equations.known = {{"x'", {{"v", {1, 0, 1, 1}, ""}}}};
  o.equations.library_of["v'"] = {"x", "v", "x^2", "x^3", "v^3", "1"};
  const IdentifiedModel m = fit_sindy({first, second}, o);
  EXPECT_EQ(coefficient(m, "x'", "v"), 1);
  EXPECT_EQ(support(m, "v'"), (std::vector<std::string>{"v", "x", "x^3"}));
  EXPECT_NEAR(coefficient(m, "v'", "x^3"), -2, 0.02);
}

TEST(FitSindy, MapsAreIdentified) {
  // Henon 1976.
  Recording r;
  r.dt = 1;
  Eigen::VectorXd x(500), y(500);
  x[0] = 0.1, y[0] = 0.1;
  for (int k = 0; k + 1 < 500; ++k) {
    x[k + 1] = 1 - 1.4 * x[k] * x[k] + y[k];
    y[k + 1] = 0.3 * x[k];
  }
  r.add("x", Quantity::dimensionless, x);
  r.add("y", Quantity::dimensionless, y);
  SindyOptions o;
  o.states = {"x", "y"};
  o.discrete = true;
  const IdentifiedModel m = fit_sindy({r}, o);
  EXPECT_EQ(support(m, "x[k+1]"), (std::vector<std::string>{"1", "x^2", "y"}));
  EXPECT_EQ(support(m, "y[k+1]"), (std::vector<std::string>{"x"}));
  EXPECT_NEAR(coefficient(m, "x[k+1]", "x^2"), -1.4, 1e-6);
  const Eigen::MatrixXd next = predict(m, r);
  EXPECT_NEAR(next(10, 0), x[11], 1e-6);
  EXPECT_NEAR(next(10, 1), y[11], 1e-6);
}

// All 35 terms of degree 3 in four states.
TEST(FitSindyReference, WideLibrariesGiveTheExactSupport) {
  for (const testing::ZooSystem& s : testing::wide_zoo()) {
    SCOPED_TRACE(s.name);
    const IdentifiedModel m = fit_sindy({testing::zoo_record(s, 0.01, 7)}, options_for(s));
    for (const Equation& truth : s.truth.equations) {
      EXPECT_EQ(support(m, truth.lhs), support(s.truth, truth.lhs));
      for (const EquationTerm& t : truth.terms)
        EXPECT_NEAR(coefficient(m, truth.lhs, t.function) / t.coefficient.value, 1, 0.02) << t.function;
    }
  }
}

// Chaos with rare bursts and a chaotic map at 5 % noise: the true terms, or a verdict that is not ok.
TEST(FitSindyProperty, ChaosThatNoiseHidesIsFoundOrRefused) {
  IdentifyOptions o;
  o.method = Method::sindy;
  const testing::ZooSystem roessler = testing::wide_zoo().back();
  o.sindy = options_for(roessler);
  const Identification flow = identify(testing::zoo_record(roessler, 0.05, 1), o);
  bool exact = true;
  for (const Equation& truth : roessler.truth.equations)
    exact = exact && support(flow.model, truth.lhs) == support(roessler.truth, truth.lhs);
  EXPECT_TRUE(exact || flow.summary.status == Status::unusable);

  std::mt19937_64 engine(5);
  std::normal_distribution<double> normal;
  Recording henon;
  henon.dt = 1;
  Eigen::VectorXd x(800), y(800);
  x[0] = 0.1, y[0] = 0.1;
  for (int k = 0; k + 1 < 800; ++k) {
    x[k + 1] = 1 - 1.4 * x[k] * x[k] + y[k];
    y[k + 1] = 0.3 * x[k];
  }
  for (double& v : x) v += 0.05 * 0.72 * normal(engine);
  for (double& v : y) v += 0.05 * 0.22 * normal(engine);
  henon.add("x", Quantity::dimensionless, x);
  henon.add("y", Quantity::dimensionless, y);
  o.sindy = {};
  o.sindy.states = {"x", "y"};
  o.sindy.discrete = true;
  const Identification map = identify(henon, o);
  exact = support(map.model, "x[k+1]") == std::vector<std::string>{"1", "x^2", "y"} &&
          support(map.model, "y[k+1]") == std::vector<std::string>{"x"};
  EXPECT_TRUE(exact || map.summary.status != Status::ok);
}

TEST(FitSindy, FreeRunFollowsTheRecord) {
  const testing::ZooSystem s = system("Lotka-Volterra");
  const Recording r = testing::zoo_record(s, 0, 1);
  const IdentifiedModel m = fit_sindy({r}, options_for(s));
  const ModelRun run = simulate(m, r);
  EXPECT_FALSE(run.diverged);
  EXPECT_LT((run.state("x") - r["x"]).cwiseAbs().maxCoeff(), 1e-4);
  for (const StateScore& v : score(m, r)) EXPECT_LT(v.nrmse, 1e-3) << v.state;
  // Rates of the truth at the first sample: x' = 1.5 x - x y, y' = -3 y + x y.
  const Eigen::MatrixXd rates = predict(m, r);
  EXPECT_NEAR(rates(0, 0), 1.5 * 2 - 2, 1e-4);
  EXPECT_NEAR(rates(0, 1), -3 + 2, 1e-4);
}

TEST(FitSindy, CoefficientsCarryUnits) {
  const testing::ZooSystem s = system("Duffing forced");
  Recording r = testing::zoo_record(s, 0, 1);
  r.channels[0].quantity = Quantity::displacement;
  r.channels[2].quantity = Quantity::force;
  SindyOptions o;
  o.states = {"x"};
  o.inputs = {"u"};
  o.order = 2;
  const IdentifiedModel m = fit_sindy({r}, o);
  for (const EquationTerm& t : m.equations[1].terms) {
    if (t.function == "x^3") {
      EXPECT_EQ(t.unit, "1/(m^2 s^2)");
    } else if (t.function == "u") {
      EXPECT_EQ(t.unit, "1/kg");
    }
  }
}

std::string warnings(const IdentifiedModel& m) {
  std::string all;
  for (const std::string& w : m.summary.warnings) all += w + "; ";
  return all;
}

TEST(FitSindy, ADriverTakenForAStateIsToldAndTheSearchEnds) {
  const testing::ZooSystem s = system("Duffing forced");
  for (const double noise : {0.0, 0.01}) {
    SindyOptions o;
    o.states = {"x", "v", "u"};
    const IdentifiedModel m = fit_sindy({testing::zoo_record(s, noise, 2)}, o);
    EXPECT_EQ(m.summary.status, Status::unusable) << noise;
    EXPECT_NE(warnings(m).find("should be an input; least explained is u'"), std::string::npos) << warnings(m);
  }
}

TEST(FitSindy, ASearchThatIsCutShortSaysSo) {
  const testing::ZooSystem s = system("Duffing forced");
  const Recording r = testing::zoo_record(s, 0.01, 2);
  SindyOptions o = options_for(s);
  o.search.max_passes = 3;  // enough for the terms to settle, not for the trial of others
  const IdentifiedModel right = fit_sindy({r}, o);
  EXPECT_EQ(right.summary.status, Status::warning);
  EXPECT_NE(warnings(right).find("cut short after 3 passes"), std::string::npos) << warnings(right);
  EXPECT_EQ(support(right, "v'"), support(s.truth, "v'"));
  SindyOptions driver;
  driver.states = {"x", "v", "u"};
  driver.search.max_passes = 10;
  const IdentifiedModel wrong = fit_sindy({r}, driver);
  EXPECT_EQ(wrong.summary.status, Status::unusable);
  EXPECT_NE(warnings(wrong).find("after 10 passes over the free runs terms still come and go"), std::string::npos)
      << warnings(wrong);
  o.search.max_passes = 0;
  EXPECT_THROW(fit_sindy({r}, o), Error);
}

TEST(FitSindy, ParametersAreTheCoefficientsWithTheirCovariance) {
  const testing::ZooSystem s = system("Duffing forced");
  const IdentifiedModel m = fit_sindy({testing::zoo_record(s, 0.01, 3)}, options_for(s));
  ASSERT_EQ(m.parameters.size(), 5u);
  ASSERT_EQ(m.parameter_covariance.size(), 25u);
  EXPECT_EQ(m.parameter("v': x^3")->value, coefficient(m, "v'", "x^3"));
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(std::sqrt(m.parameter_covariance[6 * i]) / m.parameters[i].second.sd, 1, 1e-9);
}

TEST(FitSindy, BadInputIsToldByName) {
  const testing::ZooSystem s = system("linear");
  const Recording r = testing::zoo_record(s, 0, 1);
  SindyOptions o = options_for(s);
  EXPECT_THROW(fit_sindy({}, o), Error);
  o.states = {"x", "w"};
  EXPECT_THROW(fit_sindy({r}, o), Error);
  o = options_for(s);
  o.library = {"x", "q"};
  EXPECT_THROW(fit_sindy({r}, o), Error);
  o = options_for(s);
  o.equations.library_of["z'"] = {"x"};
  EXPECT_THROW(fit_sindy({r}, o), Error);
  Recording other = r;
  other.dt *= 2;
  EXPECT_THROW(fit_sindy({r, other}, options_for(s)), Error);
}

}  // namespace
}  // namespace whirl::identification
