#include "whirl/lagrange/physical.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "systems.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::lagrange {
namespace {

const PhysicalQuantity& quantity(const std::vector<PhysicalQuantity>& list, const std::string& name) {
  for (const PhysicalQuantity& q : list) {
    if (q.name == name) return q;
  }
  std::string all;
  for (const PhysicalQuantity& q : list) all += q.name + "; ";
  throw Error("no '" + name + "' among " + all);
}

/// Unknowns of the library at given parameters, with relative sd.
UnknownEstimates exact_unknowns(const expr::CandidateLibrary& library, const Values& truth, double relative_sd) {
  const auto n = static_cast<Eigen::Index>(library.groups.size());
  UnknownEstimates u{Eigen::VectorXd(n), Eigen::MatrixXd::Zero(n, n), {}};
  for (Eigen::Index g = 0; g < n; ++g) {
    u.value[g] = expr::evaluate(expr::Expr::parse(library.groups[static_cast<std::size_t>(g)].coefficient), truth);
    u.covariance(g, g) = std::pow(relative_sd * u.value[g], 2);
  }
  return u;
}

const Values kRotor{{"m", 1.5}, {"e", 3.4e-4}, {"phi", 2.2}, {"K1", 8500}, {"K2", 4.4e8}, {"C", 6.1}};

TEST(PhysicalReference, RotorGivesStiffnessDampingAndUnbalanceOnceTheMassIsKnown) {
  LagrangeProblem p = tied_rotor();
  p.inputs.clear();
  p.forces.clear();
  const expr::CandidateLibrary library = derive(p).library;
  const UnknownEstimates u = exact_unknowns(library, kRotor, 1e-3);

  const PhysicalParameters blind = physical_parameters(library, u, p.parameters, {"m*e", "K1/K2"});
  EXPECT_NEAR(quantity(blind.parameters, "e").value.value, 3.4e-4, 1e-10);
  EXPECT_NEAR(quantity(blind.parameters, "phi").value.value, 2.2, 1e-8);
  EXPECT_EQ(blind.parameters.size(), 2u);
  for (const char* name : {"K1/m", "K2/m", "C/m"}) {
    EXPECT_NEAR(quantity(blind.combinations, name).value.value, expr::evaluate(expr::Expr::parse(name), kRotor),
                1e-6 * expr::evaluate(expr::Expr::parse(name), kRotor));
    EXPECT_NEAR(quantity(blind.combinations, name).value.sd, 1e-3 * expr::evaluate(expr::Expr::parse(name), kRotor),
                1e-6 * expr::evaluate(expr::Expr::parse(name), kRotor));
  }
  EXPECT_EQ(quantity(blind.combinations, "K2/m").unit, "1/(m^2 s^2)");
  EXPECT_EQ(blind.undetermined, (std::vector<std::string>{"m", "K1", "K2", "C"}));
  EXPECT_EQ(blind.reported.size(), 1u);  // the ratio of the stiffnesses needs no mass, m e does
  EXPECT_EQ(blind.summary.status, Status::warning);

  p.parameters[0].value = Estimate::from_sd(1.5, 0.015);
  const PhysicalParameters known = physical_parameters(library, u, p.parameters, {"m*e"});
  EXPECT_TRUE(known.undetermined.empty());
  EXPECT_EQ(known.summary.status, Status::ok);
  EXPECT_NEAR(quantity(known.parameters, "K1").value.value, 8500, 1e-3);
  // 0.1 % of K1/m and 1 % of m, independent.
  EXPECT_NEAR(quantity(known.parameters, "K1").value.sd, 8500 * std::hypot(1e-3, 1e-2), 1e-2);
  EXPECT_NEAR(quantity(known.parameters, "K2").value.value, 4.4e8, 10);
  EXPECT_NEAR(quantity(known.parameters, "C").value.value, 6.1, 1e-6);
  EXPECT_EQ(quantity(known.reported, "m*e").unit, "kg m");
  EXPECT_NEAR(quantity(known.reported, "m*e").value.value, 1.5 * 3.4e-4, 1e-9);
  // sd of e from its two components: both 0.1 % of themselves.
  const double ec = 3.4e-4 * std::cos(2.2), es = 3.4e-4 * std::sin(2.2);
  const double sd_e = 1e-3 * std::hypot(ec * ec, es * es) / 3.4e-4;
  EXPECT_NEAR(quantity(known.parameters, "e").value.sd, sd_e, 1e-4 * sd_e);
  EXPECT_NEAR(quantity(known.reported, "m*e").value.sd, std::hypot(1.5 * sd_e, 0.015 * 3.4e-4), 1e-9);
}

TEST(PhysicalReference, InputGainGivesTheMass) {
  const LagrangeProblem p = tied_rotor();  // with forces ux, uy
  const expr::CandidateLibrary library = derive(p).library;
  const PhysicalParameters found = physical_parameters(library, exact_unknowns(library, kRotor, 1e-4), p.parameters);
  EXPECT_TRUE(found.undetermined.empty());
  for (const auto& [name, value] : kRotor)
    EXPECT_NEAR(quantity(found.parameters, name).value.value, value, 1e-6 * value) << name;
}

TEST(PhysicalReference, ExcessRelationsAreCheckedAgainstEachOther) {
  const LagrangeProblem p = two_masses();
  LagrangeProblem driven = p;
  driven.inputs = {"u", "w"};
  driven.forces = {{"x", "u"}, {"y", "w"}};
  const expr::CandidateLibrary library = derive(driven).library;  // k1/m1, k2/m1, k2/m2, 1/m1, 1/m2: five for four
  const Values truth{{"m1", 2}, {"m2", 0.5}, {"k1", 1000}, {"k2", 300}};
  UnknownEstimates u = exact_unknowns(library, truth, 0.01);
  const PhysicalParameters good = physical_parameters(library, u, p.parameters);
  EXPECT_EQ(good.excess, 1);
  EXPECT_NEAR(quantity(good.parameters, "k2").value.value, 300, 1e-4);
  EXPECT_EQ(good.summary.status, Status::ok);
  // Two ways to k2, 1.4 % each (a fraction and a mass): better than one.
  EXPECT_LT(quantity(good.parameters, "k2").value.sd, 300 * 0.0142);
  u.value[1] *= 1.3;
  EXPECT_EQ(physical_parameters(library, u, p.parameters).summary.status, Status::warning);
}

TEST(PhysicalReference, PendulumLengthNeedsOnlyGravity) {
  LagrangeProblem p = simple_pendulum();
  const expr::CandidateLibrary library = derive(p).library;
  const Values truth{{"m", 2}, {"l", 0.7}, {"g", 9.81}, {"c", 0.05}};
  for (PhysicalParameter& q : p.parameters) {
    if (q.name == "g") q.value = Estimate{9.81, 0, 9.81, 9.81};
  }
  const PhysicalParameters found =
      physical_parameters(derive(p).library, exact_unknowns(derive(p).library, truth, 0.01), p.parameters);
  EXPECT_NEAR(quantity(found.parameters, "l").value.value, 0.7, 1e-7);
  EXPECT_NEAR(quantity(found.parameters, "l").value.sd, 0.007, 1e-5);
  EXPECT_NEAR(quantity(found.combinations, "c/m").value.value, 0.025, 1e-8);
}

TEST(PhysicalReference, SofteningSpringIsNegative) {
  LagrangeProblem p = duffing_oscillator();
  const expr::CandidateLibrary library = derive(p).library;
  const Values truth{{"m", 0.3}, {"c", 0.2}, {"k", 40}, {"k3", -900}};
  const PhysicalParameters found = physical_parameters(library, exact_unknowns(library, truth, 0.01), p.parameters);
  for (const auto& [name, value] : truth)
    EXPECT_NEAR(quantity(found.parameters, name).value.value, value, 1e-6 * std::abs(value)) << name;
}

// The 95 % intervals cover the truth in 95 % of fits whose unknowns scatter by a full covariance.
TEST(PhysicalProperty, IntervalsCoverTheTruth) {
  LagrangeProblem p = tied_rotor();
  p.inputs.clear();
  p.forces.clear();
  p.parameters[0].value = Estimate::from_sd(1.5, 0.01);
  const expr::CandidateLibrary library = derive(p).library;
  UnknownEstimates u = exact_unknowns(library, kRotor, 0.01);
  const Eigen::VectorXd truth = u.value;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  const Eigen::Index n = truth.size();
  Eigen::MatrixXd mix(n, n);
  for (double& x : mix.reshaped()) x = normal(random);
  const Eigen::MatrixXd factor = u.covariance.cwiseSqrt() * mix / std::sqrt(static_cast<double>(n));
  u.covariance = factor * factor.transpose();
  const int runs = 400;
  std::map<std::string, int> hits;
  for (int run = 0; run < runs; ++run) {
    Eigen::VectorXd noise(n);
    for (double& x : noise) x = normal(random);
    u.value = truth + factor * noise;
    const double mass = 1.5 + 0.01 * normal(random);
    p.parameters[0].value = Estimate::from_sd(mass, 0.01);
    for (const PhysicalQuantity& q : physical_parameters(library, u, p.parameters).parameters) {
      hits[q.name] += q.value.covers(kRotor.at(q.name));
    }
  }
  for (const auto& [name, count] : hits) {
    EXPECT_GE(count, 0.91 * runs) << name;
    EXPECT_LE(count, 0.985 * runs) << name;
  }
  EXPECT_EQ(hits.size(), kRotor.size());
}

// An identified model in the form that the rotor identification writes: one function per unknown, covariance of the
// rotor.
TEST(PhysicalReference, UnknownsOfAnIdentifiedRotor) {
  LagrangeProblem p = tied_rotor();
  p.inputs.clear();
  p.forces.clear();
  const expr::CandidateLibrary library = derive(p).library;
  IdentifiedModel model;
  const double values[] = {5666, 2.9e8, 4.1, -2e-4, 2.7e-4};
  const expr::CandidateLibrary rotor = expr::tied_rotor_library(false);
  model.equations = {{"X2'", {}}, {"X4'", {}}};
  for (std::size_t g = 0; g < 5; ++g) {
    for (const expr::TiedEntry& e : rotor.groups[g].entries) {
      model.equations[e.equation].terms.push_back(
          {e.function.str(), Estimate::from_sd(e.factor * values[g], std::abs(values[g]) * 1e-3), ""});
    }
  }
  model.equations[0].terms.push_back({"X3", Estimate::from_sd(0.1, 1), ""});
  const UnknownEstimates u = unknown_estimates(model, library);
  ASSERT_EQ(u.value.size(), 5);
  EXPECT_EQ(u.notes.size(), 2u);  // a term too much; no covariances
  for (std::size_t g = 0; g < 5; ++g) {
    std::size_t at = 0;
    while (at < 5 &&
           expr::Expr::parse(library.groups[at].coefficient) != expr::Expr::parse(rotor.groups[g].coefficient))
      ++at;
    ASSERT_LT(at, 5u);
    EXPECT_NEAR(u.value[static_cast<Eigen::Index>(at)], values[g], 1e-9 * std::abs(values[g]));
    EXPECT_NEAR(u.covariance(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(at)),
                std::pow(values[g] * 1e-3, 2), 1e-9 * values[g] * values[g]);
  }
  model.rotor_covariance.assign(25, 0);
  for (std::size_t i = 0; i < 5; ++i) model.rotor_covariance[6 * i] = 1 + static_cast<double>(i);
  model.rotor_covariance[1] = model.rotor_covariance[5] = -0.5;
  const UnknownEstimates full = unknown_estimates(model, library);
  EXPECT_EQ(full.covariance(0, 1), -0.5);
  EXPECT_EQ(full.covariance(1, 1), 2);

  model.equations[1].terms[0].coefficient = Estimate::from_sd(-6000, 1);  // y stiffer than the tie allows
  EXPECT_THROW((void)unknown_estimates(model, library), Error);
  model.equations.pop_back();
  EXPECT_THROW((void)unknown_estimates(model, library), Error);
}

TEST(PhysicalReference, UnknownsByNameWithTheirCovariance) {
  const expr::CandidateLibrary library = derive(simple_pendulum()).library;
  IdentifiedModel model;
  model.parameters = {{"other", Estimate::from_sd(1, 1)},
                      {library.groups[0].name, Estimate::from_sd(14, 2)},
                      {library.groups[1].name, Estimate::from_sd(0.05, 0.1)}};
  model.parameter_covariance = {1, 0, 0, 0, 4, 0.06, 0, 0.06, 0.01};
  const UnknownEstimates u = unknown_estimates(model, library);
  EXPECT_EQ(u.value, Eigen::Vector2d(14, 0.05));
  EXPECT_EQ(u.covariance(0, 1), 0.06);
}

TEST(PhysicalReference, CoefficientsOfAnUntiedFitKeepTheirCovariance) {
  const expr::CandidateLibrary library = derive(simple_pendulum()).library;
  IdentifiedModel model;
  model.equations.push_back({library.lhs[0], {}});
  for (std::size_t g = 0; g < 2; ++g) {
    const expr::TiedEntry& entry = library.groups[g].entries.front();
    const Estimate unknown = g == 0 ? Estimate::from_sd(14, 2) : Estimate::from_sd(0.05, 0.1);
    model.equations[0].terms.push_back(
        {entry.function.str(), Estimate::from_sd(entry.factor * unknown.value, unknown.sd), ""});
    model.parameters.emplace_back(library.lhs[0] + ": " + entry.function.str(),
                                  model.equations[0].terms.back().coefficient);
  }
  const double sign = library.groups[0].entries.front().factor * library.groups[1].entries.front().factor;
  model.parameter_covariance = {4, 0.06 * sign, 0.06 * sign, 0.01};
  const UnknownEstimates u = unknown_estimates(model, library);
  EXPECT_TRUE(u.notes.empty());
  EXPECT_NEAR(u.value[0], 14, 1e-9);
  EXPECT_NEAR(u.covariance(0, 0), 4, 1e-9);
  EXPECT_NEAR(u.covariance(0, 1), 0.06, 1e-9);
  model.parameter_covariance.clear();
  EXPECT_EQ(unknown_estimates(model, library).covariance(0, 1), 0);
  EXPECT_EQ(unknown_estimates(model, library).notes.size(), 1u);
}

}  // namespace
}  // namespace whirl::lagrange
