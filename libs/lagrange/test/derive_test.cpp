#include "whirl/lagrange/derive.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <map>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/rotor/equations.hpp"

namespace whirl {
namespace {

using Values = std::map<std::string, double, std::less<>>;

// Paper eqs. 2 and 12: disk with centre of mass G at distance e from C, J = J_bar + m e^2 about C.
LagrangeProblem paper_rotor() {
  LagrangeProblem p;
  p.coordinates = {"x", "y", "b"};
  p.parameters = {"m", "J", "e", "K1", "K2", "Cx", "Cy", "Ux", "Uy", "tau"};
  p.kinetic = "m*((dx - e*sin(b)*db)^2 + (dy + e*cos(b)*db)^2)/2 + (J - m*e^2)*db^2/2";
  p.potential = "K1*(x^2 + y^2)/2 + K2*(x^2 + y^2)^2/4";
  p.rayleigh = "Cx*dx^2/2 + Cy*dy^2/2";
  p.forces = {"Ux", "Uy", "tau"};
  return p;
}

double value(const std::string& text, const Values& values) { return evaluate(Expr::parse(text), values); }

// The candidate that `term` is, as a canonical text: equal up to the order of factors.
bool same(const std::string& a, const std::string& b) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> number(0.5, 2);
  for (int trial = 0; trial < 4; ++trial) {
    Values v;
    for (const char* name : {"x", "y", "b", "dx", "dy", "db", "m", "J", "e", "K1", "K2", "Cx", "Cy", "Ux", "Uy", "tau"}) {
      v[name] = number(random);
    }
    if (std::abs(value(a, v) - value(b, v)) > 1e-12 * (1 + std::abs(value(a, v)))) return false;
  }
  return true;
}

void expect_terms(const std::vector<std::string>& found, const std::vector<std::string>& expected) {
  EXPECT_EQ(found.size(), expected.size());
  for (const std::string& e : expected) {
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](const auto& f) { return same(f, e); })) << e;
  }
}

// Paper eq. 5 with eq. 13, sign by sign (corrected as in docs/paper-errata.md).
TEST(LagrangeReference, PaperRotorGivesEquationFiveTermByTerm) {
  const LagrangeEquations eq = derive(paper_rotor());
  const char* mass[3][3] = {{"m", "0", "-m*e*sin(b)"}, {"0", "m", "m*e*cos(b)"}, {"-m*e*sin(b)", "m*e*cos(b)", "J"}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) EXPECT_TRUE(same(eq.mass[i][j], mass[i][j])) << eq.mass[i][j];
  }
  expect_terms(eq.terms[0], {"-K1*x", "-K2*x^3", "-K2*x*y^2", "-Cx*dx", "m*e*db^2*cos(b)", "Ux"});
  expect_terms(eq.terms[1], {"-K1*y", "-K2*y^3", "-K2*x^2*y", "-Cy*dy", "m*e*db^2*sin(b)", "Uy"});
  expect_terms(eq.terms[2], {"tau"});
  EXPECT_TRUE(same(eq.determinant, "m^2*(J - m*e^2)")) << eq.determinant;
}

// The equations that simulate the rig, solved for the accelerations, against the derived ones at random states.
TEST(LagrangeReference, RotorLibraryAgreesWithTheDerivationAtRandomStates) {
  const LagrangeEquations eq = derive(paper_rotor());
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    UnbalancedDisk disk;
    disk.mass = 1.5 + number(random);
    disk.eccentricity = 0.05 * (1.5 + number(random));
    disk.inertia = 0.2 + 0.1 * number(random);
    disk.stiffness = 100 * (2 + number(random));
    disk.cubic = 1e3 * (2 + number(random));
    disk.damping_x = 1 + number(random);
    disk.damping_y = 1 + number(random);
    const DiskState s{number(random), number(random), number(random), number(random), 3 * number(random), 5 * number(random)};
    const double ux = number(random), uy = number(random), tau = number(random);
    const Values v{{"x", s.x},     {"y", s.y},         {"b", s.beta},  {"dx", s.dx},       {"dy", s.dy},
                   {"db", s.omega}, {"m", disk.mass},   {"J", disk.inertia}, {"e", disk.eccentricity},
                   {"K1", disk.stiffness}, {"K2", disk.cubic}, {"Cx", disk.damping_x}, {"Cy", disk.damping_y},
                   {"Ux", ux},     {"Uy", uy},         {"tau", tau}};
    Eigen::Matrix3d m;
    Eigen::Vector3d h;
    for (std::size_t i = 0; i < 3; ++i) {
      h[static_cast<int>(i)] = value(eq.rhs[i], v);
      for (std::size_t j = 0; j < 3; ++j) m(static_cast<int>(i), static_cast<int>(j)) = value(eq.mass[i][j], v);
    }
    const Eigen::Vector3d expected = m.fullPivLu().solve(h);
    const DiskAcceleration found = lagrange_acceleration(disk, s, ux, uy, tau);
    const double scale = 1 + expected.norm();
    EXPECT_NEAR(found.ddx, expected[0], 1e-10 * scale);
    EXPECT_NEAR(found.ddy, expected[1], 1e-10 * scale);
    EXPECT_NEAR(found.alpha, expected[2], 1e-10 * scale);
  }
}

TEST(LagrangeReference, PendulumAndTwoMasses) {
  LagrangeProblem pendulum;
  pendulum.coordinates = {"b"};
  pendulum.parameters = {"m", "J", "e"};
  pendulum.kinetic = "m*e^2*db^2/2";
  pendulum.potential = "-m*J*e*cos(b)";  // J stands for gravity
  const LagrangeEquations eq = derive(pendulum);
  EXPECT_TRUE(same(eq.mass[0][0], "m*e^2"));
  expect_terms(eq.terms[0], {"-m*J*e*sin(b)"});

  LagrangeProblem pair;
  pair.coordinates = {"x", "y"};
  pair.parameters = {"m", "K1", "K2"};
  pair.kinetic = "m*dx^2/2 + m*dy^2";
  pair.potential = "K1*x^2/2 + K2*(y - x)^2/2";
  const LagrangeEquations two = derive(pair);
  EXPECT_TRUE(same(two.rhs[0], "-K1*x + K2*(y - x)"));
  EXPECT_TRUE(same(two.rhs[1], "-K2*(y - x)"));
  EXPECT_TRUE(same(two.determinant, "2*m^2"));
}

TEST(Lagrange, BadProblemsAreRefusedWithTheReason) {
  LagrangeProblem p = paper_rotor();
  p.kinetic = "m*(dx^2";
  EXPECT_THROW((void)derive(p), Error);
  p = paper_rotor();
  p.potential = "K3*x^2";
  EXPECT_THROW((void)derive(p), Error);
  p = paper_rotor();
  p.forces = {"Ux"};
  EXPECT_THROW((void)derive(p), Error);
  p = paper_rotor();
  p.parameters.push_back("m");
  EXPECT_THROW((void)derive(p), Error);
}

}  // namespace
}  // namespace whirl
