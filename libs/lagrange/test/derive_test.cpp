#include "whirl/lagrange/derive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "systems.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/lagrange/lagrange_file.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::lagrange {
namespace {

void expect_same(const expr::Expr& found, const char* expected) {
  EXPECT_EQ(expr::expand(found - expr::Expr::parse(expected)), expr::Expr(0))
      << found.str() << "\nexpected " << expected;
}

const expr::TiedGroup& group(const LagrangeEquations& eq, const std::string& coefficient) {
  for (const expr::TiedGroup& g : eq.library.groups) {
    if (g.coefficient == coefficient) return g;
  }
  std::string all;
  for (const expr::TiedGroup& g : eq.library.groups) all += g.coefficient + "; ";
  throw Error("no group '" + coefficient + "' among " + all);
}

/// The terms of a group, one per equation.
void expect_group(const LagrangeEquations& eq, const std::string& coefficient, const std::vector<const char*>& terms) {
  const std::vector<expr::Expr> found = expr::group_terms(group(eq, coefficient), terms.size());
  for (std::size_t i = 0; i < terms.size(); ++i) {
    EXPECT_EQ(expr::expand(found[i] - expr::Expr::parse(terms[i])), expr::Expr(0))
        << coefficient << " in equation " << i << ": " << found[i].str();
  }
}

// Paper eq. 5 with eq. 13, sign by sign (corrected as in docs/paper-errata.md).
TEST(LagrangeReference, PaperRotorGivesEquationFive) {
  const LagrangeEquations eq = derive(paper_rotor());
  const char* mass[3][3] = {{"m", "0", "-m*e*sin(b)"}, {"0", "m", "m*e*cos(b)"}, {"-m*e*sin(b)", "m*e*cos(b)", "J"}};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) expect_same(eq.mass[i][j], mass[i][j]);
  }
  expect_same(eq.rhs[0], "-K1*x - K2*x^3 - K2*x*y^2 - Cx*x' + m*e*b'^2*cos(b) + Ux");
  expect_same(eq.rhs[1], "-K1*y - K2*y^3 - K2*x^2*y - Cy*y' + m*e*b'^2*sin(b) + Uy");
  expect_same(eq.rhs[2], "tau");
  expect_same(eq.determinant, "m^2*J - m^3*e^2");
  EXPECT_FALSE(eq.implicit);
}

// Eq. 21 with J_bar, the coupling that the paper drops included, to first order in e.
TEST(LagrangeReference, PaperRotorSolvedGivesEquationTwentyOneAndTheCoupling) {
  LagrangeProblem p = paper_rotor();
  p.parameters[1].name = "J_bar";
  p.kinetic = "m*((x' - e*sin(b)*b')^2 + (y' + e*cos(b)*b')^2)/2 + J_bar*b'^2/2";
  p.order = {{"e", 1}};
  const LagrangeEquations eq = derive(p);
  expect_same(eq.accelerations[0],
              "-K1/m*x - K2/m*x^3 - K2/m*x*y^2 - Cx/m*x' + e*b'^2*cos(b) + e/J_bar*tau*sin(b) + Ux/m");
  expect_same(eq.accelerations[1],
              "-K1/m*y - K2/m*y^3 - K2/m*x^2*y - Cy/m*y' + e*b'^2*sin(b) - e/J_bar*tau*cos(b) + Uy/m");
  expect_same(eq.accelerations[2],
              "tau/J_bar + e/J_bar*((K1*y + K2*y*(x^2 + y^2) + Cy*y' - Uy)*cos(b) - (K1*x + K2*x*(x^2 + y^2) + Cx*x' - "
              "Ux)*sin(b))");
}

// The tied library of a prescribed angle is the one that the identification uses, written by hand there.
TEST(LagrangeReference, PrescribedAngleGivesTheTiedRotorLibrary) {
  const LagrangeEquations eq = derive(tied_rotor());
  const expr::CandidateLibrary hand = expr::tied_rotor_library(false, false, true);
  ASSERT_EQ(eq.library.groups.size(), hand.groups.size());
  EXPECT_EQ(eq.library.lhs, hand.lhs);
  for (const expr::TiedGroup& expected : hand.groups) {
    const std::vector<expr::Expr> sums = expr::group_terms(expected, 2);
    const std::string x = sums[0].str(), y = sums[1].str();
    expect_group(eq, expr::Expr::parse(expected.coefficient).str(), {x.c_str(), y.c_str()});
    EXPECT_EQ(group(eq, expr::Expr::parse(expected.coefficient).str()).unit, expected.unit) << expected.name;
  }
}

// Eq. 24 without its exponentials: with the motor and friction torques of eqs. 7 to 11 for one direction of rotation,
// the functions of all three equations are the 17 of the paper.
TEST(LagrangeReference, TorqueLawGivesTheFunctionsOfEquationTwentyFour) {
  LagrangeProblem p = tied_rotor();
  p.inputs.clear();
  p.forces.clear();
  for (PhysicalParameter& parameter : p.parameters) {
    if (parameter.name == "phi") parameter.name = "J_bar";
  }
  p.kinetic = "m*((x' - e*sin(b)*b')^2 + (y' + e*cos(b)*b')^2)/2";
  for (const char* name : {"Cm1", "Cm2", "Cc", "Cv", "Ca"}) p.parameters.push_back({name, "", {}});
  p.prescribed[0].acceleration = "(Cm1 - Cm2*b' - Cc*sgn(b') - Cv*b' - Ca*b'*abs(b'))/J_bar";
  const auto functions = [](const LagrangeEquations& eq, std::size_t equation) {
    std::vector<expr::Expr> found;
    for (const expr::TiedGroup& g : eq.library.groups) {
      for (const expr::TiedEntry& entry : g.entries) {
        if (equation < 3 && entry.equation != equation) continue;
        const expr::Expr sum = expr::expand(entry.function);
        const std::vector<expr::Expr> terms =
            sum.kind() == expr::Expr::Kind::sum ? sum.args() : std::vector<expr::Expr>{sum};
        for (const expr::Expr& term : terms) found.push_back(expr::split_coefficient(term).second);
      }
    }
    found = expr::union_library({found});
    std::sort(found.begin(), found.end(), [](const expr::Expr& a, const expr::Expr& b) { return compare(a, b) < 0; });
    return found;
  };
  const auto sorted = [](std::vector<expr::Expr> terms) {
    std::sort(terms.begin(), terms.end(), [](const expr::Expr& a, const expr::Expr& b) { return compare(a, b) < 0; });
    return terms;
  };
  // Any direction: sgn and X6|X6| beside them.
  const LagrangeEquations both = derive(p);
  EXPECT_EQ(functions(both, 0), sorted(expr::parse_library({"X1", "X1^3", "X1*X3^2", "X2", "X6^2*cos(X5)", "sin(X5)",
                                                            "X6*sin(X5)", "sgn(X6)*sin(X5)", "X6*abs(X6)*sin(X5)"})));
  EXPECT_EQ(functions(both, 2), sorted(expr::parse_library({"1", "X6", "sgn(X6)", "X6*abs(X6)"})));
  p.positive = {"b'"};
  const LagrangeEquations forward = derive(p);
  EXPECT_EQ(functions(forward, 3), sorted(expr::rotor_library()));
  EXPECT_EQ(forward.lhs, (std::vector<std::string>{"x''", "y''", "b''"}));
  EXPECT_EQ(forward.library.lhs, (std::vector<std::string>{"X2'", "X4'", "X6'"}));
  // sin(X5) in x'' and -cos(X5) in y'' share e (Cm1 - Cc)/J_bar.
  expect_group(forward, "-Cc*e/J_bar + Cm1*e/J_bar", {"sin(X5)", "-cos(X5)", "0"});
}

// The equations that simulate the rig, solved for the accelerations, against the derived ones at random states.
TEST(LagrangeProperty, RotorLibraryAgreesWithTheDerivationAtRandomStates) {
  const LagrangeEquations eq = derive(paper_rotor());
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    rotor::UnbalancedDisk disk;
    disk.mass = 1.5 + number(random);
    disk.eccentricity = 0.05 * (1.5 + number(random));
    disk.inertia = 0.2 + 0.1 * number(random);
    disk.stiffness = 100 * (2 + number(random));
    disk.cubic = 1e3 * (2 + number(random));
    disk.damping_x = 1 + number(random);
    disk.damping_y = 1 + number(random);
    const rotor::DiskState s{number(random), number(random),     number(random),
                             number(random), 3 * number(random), 5 * number(random)};
    const double ux = number(random), uy = number(random), tau = number(random);
    const Values v{{"x", s.x},
                   {"y", s.y},
                   {"b", s.beta},
                   {"x'", s.dx},
                   {"y'", s.dy},
                   {"b'", s.omega},
                   {"m", disk.mass},
                   {"J", disk.inertia},
                   {"e", disk.eccentricity},
                   {"K1", disk.stiffness},
                   {"K2", disk.cubic},
                   {"Cx", disk.damping_x},
                   {"Cy", disk.damping_y},
                   {"Ux", ux},
                   {"Uy", uy},
                   {"tau", tau}};
    const rotor::DiskAcceleration expected = rotor::lagrange_acceleration(disk, s, ux, uy, tau);
    const double scale = 1 + std::abs(expected.ddx) + std::abs(expected.ddy) + std::abs(expected.alpha);
    EXPECT_NEAR(expr::evaluate(eq.accelerations[0], v), expected.ddx, 1e-10 * scale);
    EXPECT_NEAR(expr::evaluate(eq.accelerations[1], v), expected.ddy, 1e-10 * scale);
    EXPECT_NEAR(expr::evaluate(eq.accelerations[2], v), expected.alpha, 1e-10 * scale);
  }
}

// For every shipped kind of system, at random states and parameters: M q'' = h holds for the accelerations, and the
// library with its coefficients evaluated gives the same accelerations.
TEST(LagrangeProperty, LibraryTimesCoefficientsIsTheAcceleration) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> number(0.4, 1.6);
  for (const LagrangeProblem& p : all_systems()) {
    const LagrangeEquations eq = derive(p);
    std::vector<expr::Expr> unknowns;
    for (const expr::TiedGroup& g : eq.library.groups) unknowns.push_back(expr::Expr::parse(g.coefficient));
    const std::vector<expr::Expr> rhs = expr::right_hand_sides(eq.library, unknowns);
    for (int trial = 0; trial < 20; ++trial) {
      Values v{{"t", number(random)}};
      std::vector<std::string> motions = p.coordinates;
      for (const PrescribedSignal& s : p.prescribed) motions.push_back(s.name);
      for (const std::string& q : motions) {
        for (const char* prime : {"", "'", "''"}) v[q + prime] = number(random) - (p.positive.empty() ? 1 : 0);
      }
      for (const std::string& u : p.inputs) v[u] = number(random);
      for (const PhysicalParameter& a : p.parameters) v[a.name] = a.known() ? a.value.value : number(random);
      Values renamed = v;
      for (const auto& [from, to] : p.names) renamed[to] = v[from];
      const auto n = static_cast<Eigen::Index>(p.coordinates.size());
      Eigen::VectorXd residual(n);
      double scale = 1;
      if (!eq.implicit) {
        for (Eigen::Index j = 0; j < n; ++j) {
          v[p.coordinates[static_cast<std::size_t>(j)] + "''"] =
              expr::evaluate(eq.accelerations[static_cast<std::size_t>(j)], v);
        }
      }
      for (Eigen::Index i = 0; i < n; ++i) {
        const auto row = static_cast<std::size_t>(i);
        if (!eq.implicit) {
          double force = -expr::evaluate(eq.rhs[row], v);
          for (std::size_t j = 0; j < p.coordinates.size(); ++j)
            force += expr::evaluate(eq.mass[row][j], v) * v[p.coordinates[j] + "''"];
          EXPECT_NEAR(force, 0, 1e-10 * (1 + std::abs(expr::evaluate(eq.rhs[row], v)))) << p.kinetic;
        }
        const double a = expr::evaluate(eq.accelerations[row], v);
        scale = std::max(scale, std::abs(a));
        EXPECT_NEAR(expr::evaluate(rhs[row], renamed), a, 1e-10 * scale) << p.kinetic;
      }
    }
  }
}

// Lagrange's equation written out with the derivatives of `expr`, which share nothing with the computer algebra: its
// left minus right side vanishes at the accelerations found.
TEST(LagrangeProperty, EveryDerivedAccelerationSolvesLagrangesEquation) {
  std::mt19937_64 random(23);
  std::uniform_real_distribution<double> number(-1, 1);
  for (const LagrangeProblem& p : all_systems()) {
    const LagrangeEquations eq = derive(p);
    std::vector<std::string> motions = p.coordinates;
    for (const PrescribedSignal& s : p.prescribed) motions.push_back(s.name);
    const auto read = [](const std::string& text) { return text.empty() ? expr::Expr(0) : expr::Expr::parse(text); };
    const expr::Expr kinetic = read(p.kinetic);
    for (std::size_t i = 0; i < p.coordinates.size(); ++i) {
      const std::string& q = p.coordinates[i];
      const expr::Expr momentum = expr::differentiate(kinetic, q + "'");
      std::vector<expr::Expr> parts{expr::differentiate(momentum, "t"), -expr::differentiate(kinetic, q),
                                    expr::differentiate(read(p.potential), q),
                                    expr::differentiate(read(p.rayleigh), q + "'")};
      for (const std::string& m : motions) {
        parts.push_back(expr::differentiate(momentum, m) * expr::Expr::symbol(m + "'"));
        parts.push_back(expr::differentiate(momentum, m + "'") * expr::Expr::symbol(m + "''"));
      }
      if (p.forces.count(q) != 0) parts.push_back(-read(p.forces.at(q)));
      for (int trial = 0; trial < 20; ++trial) {
        Values v{{"t", number(random)}};
        for (const std::string& m : motions) {
          for (const char* prime : {"", "'", "''"}) v[m + prime] = number(random);
        }
        for (const std::string& u : p.inputs) v[u] = number(random);
        for (const PhysicalParameter& a : p.parameters) v[a.name] = 1.2 + number(random);
        // Implicit rows hold for whatever the other accelerations are; solved ones need all of theirs.
        const Values before = v;
        for (std::size_t j = 0; j < p.coordinates.size(); ++j) {
          if (!eq.implicit || j == i) v[p.coordinates[j] + "''"] = expr::evaluate(eq.accelerations[j], before);
        }
        double sum = 0, scale = 1;
        for (const expr::Expr& part : parts) {
          const double x = expr::evaluate(part, v);
          sum += x;
          scale += std::abs(x);
        }
        EXPECT_NEAR(sum, 0, 1e-10 * scale) << p.kinetic;
      }
    }
  }
}

TEST(LagrangeReference, ClosedFormsOfTheSmallSystems) {
  const LagrangeEquations duffing = derive(duffing_oscillator());
  expect_same(duffing.accelerations[0], "-c/m*x' - k/m*x - k3/m*x^3 + u/m");
  expect_group(duffing, "k3/m", {"-x^3"});
  EXPECT_EQ(group(duffing, "k3/m").unit, "1/(m^2 s^2)");

  const LagrangeEquations pendulum = derive(simple_pendulum());
  expect_same(pendulum.accelerations[0], "-g/l*sin(a) - c/(m*l^2)*a'");

  const LagrangeEquations two = derive(two_masses());
  expect_same(two.accelerations[0], "-k1/m1*x - k2/m1*(x - y)");
  expect_same(two.accelerations[1], "-k2/m2*(y - x)");
  expect_group(two, "k2/m1", {"y - x", "0"});
  expect_same(two.determinant, "m1*m2");

  // Two springs side by side are never seen apart.
  LagrangeProblem side = duffing_oscillator();
  side.potential += " + ka*x^2/2";
  side.parameters.push_back({"ka", "N/m", {}});
  EXPECT_EQ(derive(side).library.groups.size(), duffing.library.groups.size());
  expect_group(derive(side), "k/m + ka/m", {"-x"});
}

// A cart with a pendulum has a state-dependent mass matrix: each row for its own acceleration.
TEST(LagrangeReference, PendulumOnACartIsGivenRowByRow) {
  const LagrangeEquations eq = derive(cart_pendulum());
  EXPECT_TRUE(eq.implicit);
  expect_same(eq.mass[0][1], "m*l*cos(a)");
  expect_same(eq.accelerations[1], "-g/l*sin(a) - x''*cos(a)/l");
  expect_group(eq, "1/l", {"0", "-x''*cos(a)"});
}

// Green's equations of the disk on an elastic shaft: both whirl directions share every coefficient.
TEST(LagrangeReference, GyroscopicRotorTiesBothPlanes) {
  const LagrangeEquations eq = derive(gyroscopic_rotor());
  expect_same(eq.accelerations[0], "-c11/m*x' - k11/m*x - k12/m*u + e*(b'^2*cos(b) + b''*sin(b))");
  expect_same(eq.accelerations[1], "-c11/m*y' - k11/m*y - k12/m*v + e*(b'^2*sin(b) - b''*cos(b))");
  expect_same(eq.accelerations[2], "-Ip/Id*b'*v' - c22/Id*u' - k12/Id*x - k22/Id*u");
  expect_same(eq.accelerations[3], "Ip/Id*b'*u' - c22/Id*v' - k12/Id*y - k22/Id*v");
  EXPECT_EQ(eq.library.groups.size(), 8u);
}

TEST(Lagrange, SymmetriesTieTheParametersOfAGeneralPotential) {
  LagrangeProblem p;
  p.coordinates = {"x", "y"};
  for (const char* name : {"m", "Kx", "Ky", "Kxy", "a", "b", "c", "d", "Cx", "Cy"})
    p.parameters.push_back({name, "", {}});
  p.kinetic = "m*(x'^2 + y'^2)/2";
  p.potential = "Kx*x^2/2 + Ky*y^2/2 + Kxy*x*y + a*x^4 + b*x^2*y^2 + c*y^4 + d*x^3";
  p.rayleigh = "Cx*x'^2/2 + Cy*y'^2/2";
  p.symmetries = {"rotation x y"};
  const LagrangeEquations eq = derive(p);
  expect_same(eq.rhs[0], "-Kx*x - 4*a*x^3 - 4*a*x*y^2 - Cx*x'");
  expect_same(eq.rhs[1], "-Kx*y - 4*a*y^3 - 4*a*x^2*y - Cx*y'");
  EXPECT_EQ(eq.notes.size(), 6u);  // Ky, Kxy, b, c, d, Cy
  p.symmetries = {"mirror x"};
  expect_same(derive(p).rhs[0], "-Kx*x - 4*a*x^3 - 2*b*x*y^2 - Cx*x'");
  p.symmetries = {"exchange x y", "mirror x y"};
  expect_same(derive(p).rhs[1], "-Kx*y - Kxy*x - 4*a*y^3 - 2*b*x^2*y - Cx*y'");
  for (const char* wrong : {"rotation x", "turn x y", "mirror z", ""}) {
    p.symmetries = {wrong};
    EXPECT_THROW((void)derive(p), Error) << wrong;
  }
}

// Two variables of one name would make one column of both; text that is no name would make another library.
TEST(Lagrange, NamesInTheLibraryAreIdentifiersAndEachVariableHasItsOwn) {
  const auto reason = [](const std::string& variable, const std::string& name) {
    LagrangeProblem p = duffing_oscillator();
    p.names = {{"x", "X1"}, {"x'", "X2"}};
    p.names[variable] = name;
    EXPECT_EQ(name_problem(p).has_value(), testing::error_of([&] { (void)derive(p); }) != "no error") << name;
    return name_problem(p).value_or(NameProblem{"none", ""}).variable;
  };
  EXPECT_EQ(reason("x", "X1"), "none");
  EXPECT_EQ(reason("x'", "X1"), "x'");
  EXPECT_EQ(reason("x'", "t"), "x'");
  EXPECT_EQ(reason("x", "X2'"), "x");  // that of x''
  for (const char* text : {"", "X-inf", "X 1", "1X", "sin", "pi", "X1*X2", "X1\"]\nknown = [\""}) {
    EXPECT_EQ(reason("x'", text), "x'") << text;
  }
}

TEST(Lagrange, AFileWithANameTwiceIsRefusedWithItsLine) {
  const testing::TemporaryFolder folder;
  const auto refusal = [&](const std::string& name) {
    folder.write("s.toml",
                 "coordinates = [\"x\"]\nprescribed = [\"beta\"]\nkinetic = \"m*x'^2/2\"\n[parameters]\nm = \"kg\"\n"
                 "[names]\nx = \"X1\"\nbeta = \"" +
                     name + "\"\n");
    return testing::error_of([&] { (void)read_lagrange_file(folder.path() / "s.toml"); });
  };
  EXPECT_EQ(refusal("X5"), "no error");
  EXPECT_THAT(refusal("X1"), ::testing::HasSubstr("s.toml:8: names.beta"));
  EXPECT_THAT(refusal("X-inf"), ::testing::HasSubstr("s.toml:8: names.beta"));
}

TEST(Lagrange, ParametersWithValuesLeaveTheUnknowns) {
  LagrangeProblem p = duffing_oscillator();
  p.parameters.push_back({"v0", "m/s", Estimate{0.01, 0, 0.01, 0.01}});
  p.parameters.push_back({"F", "N", {}});
  p.forces["x"] += " - F*tanh(x'/v0)";
  expect_group(derive(p), "F/m", {"-tanh(100*x')"});
  p.parameters[p.parameters.size() - 2].value = {};
  EXPECT_THROW((void)derive(p), Error);  // v0 inside tanh
  p = duffing_oscillator();
  for (PhysicalParameter& a : p.parameters) {
    if (a.name == "m") a.value = Estimate{2, 0, 2, 2};
  }
  const LagrangeEquations eq = derive(p);
  ASSERT_EQ(eq.library.known.size(), 1u);
  expect_same(eq.library.known[0], "0.5*u");
}

TEST(Lagrange, BadProblemsAreRefusedWithTheReason) {
  const auto message = [](const LagrangeProblem& p) -> std::string {
    try {
      (void)derive(p);
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  LagrangeProblem p = paper_rotor();
  p.kinetic = "m*(x'^2";
  EXPECT_NE(message(p).find("kinetic energy 'm*(x'^2'"), std::string::npos) << message(p);
  p = paper_rotor();
  p.potential = "K3*x^2";
  EXPECT_NE(message(p).find("'K3' is not declared"), std::string::npos) << message(p);
  p = paper_rotor();
  p.forces["z"] = "Ux";
  EXPECT_NE(message(p).find("'z' is not a coordinate"), std::string::npos) << message(p);
  p = paper_rotor();
  p.parameters.push_back({"m", "kg", {}});
  EXPECT_NE(message(p).find("declared twice"), std::string::npos) << message(p);
  p = paper_rotor();
  p.kinetic = "m*x'^2/2 + J*b'^2/2";
  EXPECT_NE(message(p).find("singular"), std::string::npos) << message(p);
  p = paper_rotor();
  p.potential = "((x + y + b)^30 + x)^30";
  EXPECT_NE(message(p).find("multiplied out"), std::string::npos) << message(p);
  p = paper_rotor();
  p.names["w"] = "X9";
  EXPECT_THROW((void)derive(p), Error);
}

}  // namespace
}  // namespace whirl::lagrange
