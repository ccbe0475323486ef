#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <random>

#include "made_files.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

std::string example(const std::string& name) { return source_dir() + "/examples/05_derive/" + name; }

TEST(DeriveE2e, EveryExampleGivesEquationsLatexAndALibraryThatReadsBack) {
  const Folder folder;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(example(""))) {
    if (entry.path().extension() != ".toml") continue;
    ++files;
    const std::string file = entry.path().string();
    const Outcome printed = folder.whirl("derive " + file + " --out library.toml --json");
    ASSERT_EQ(printed.exit_code, 0) << file << printed.err;
    const io::Json document = io::parse_json(printed.out, "stdout");
    const expr::CandidateLibrary library = io::read_library(folder / "library.toml");
    EXPECT_EQ(library.groups.size(), document.find("library")->find("groups")->get<io::Json::Array>()->size()) << file;
    EXPECT_FALSE(*document.find("implicit")->get<bool>()) << file;
    const Outcome latex = folder.whirl("derive " + file + " --latex");
    EXPECT_EQ(latex.out.find("\\begin{aligned}"), 0u) << file;
    EXPECT_NE(folder.whirl("derive " + file).out.find("Library: "), std::string::npos);
  }
  EXPECT_GE(files, 8);
}

// The file of the paper's torque law: the functions over all equations are the 17 of eq. 24.
TEST(DeriveE2e, PaperFileGivesTheFunctionsOfEquationTwentyFour) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("derive " + example("paper_eq24.toml") + " --out l.toml").exit_code, 0);
  const expr::CandidateLibrary library = io::read_library(folder / "l.toml");
  std::vector<expr::Expr> functions;
  for (const expr::TiedGroup& group : library.groups) {
    for (const expr::TiedEntry& e : group.entries) {
      const std::vector<expr::Expr> terms =
          e.function.kind() == expr::Expr::Kind::sum ? e.function.args() : std::vector<expr::Expr>{e.function};
      functions.insert(functions.end(), terms.begin(), terms.end());
    }
  }
  functions = expr::union_library({functions});
  EXPECT_EQ(functions.size(), 17u);
  EXPECT_EQ(expr::union_library({expr::rotor_library(), functions}).size(), 17u);
}

// The derived library of the measured-angle rotor is the hand-written one, up to names and order.
TEST(DeriveE2e, RotorFileGivesTheFiveTiedUnknowns) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("derive " + example("rotor.toml") + " --out l.toml").exit_code, 0);
  const expr::CandidateLibrary library = io::read_library(folder / "l.toml"), hand = expr::tied_rotor_library(false);
  EXPECT_EQ(library.lhs, hand.lhs);
  EXPECT_EQ(library.groups.size(), hand.groups.size());
  for (const expr::TiedGroup& group : hand.groups) {
    const bool found = std::any_of(library.groups.begin(), library.groups.end(), [&](const expr::TiedGroup& g) {
      if (g.unit != group.unit || expr::Expr::parse(g.coefficient) != expr::Expr::parse(group.coefficient))
        return false;
      const expr::CandidateLibrary pair{hand.lhs, {}, {g, group}, {}};
      for (const expr::Expr& rest : expr::right_hand_sides(pair, {expr::Expr(1), expr::Expr(-1)})) {
        if (!expr::expand(rest).is_number(0)) return false;
      }
      return true;
    });
    EXPECT_TRUE(found) << group.name;
  }
}

// Record, fit, derivation, parameters: the rig's own numbers come back inside a few standard deviations of the weighed
// mass.
TEST(DeriveE2e, PhysicalParametersComeBackFromAnIdentifiedModel) {
  const Folder folder;
  copy_model(folder);
  const Outcome found = folder.whirl("derive " + example("anisotropic.toml") + " --model model.json --json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const io::Json document = io::parse_json(found.out, "stdout");
  const io::JsonReader in(document, "stdout");
  const auto check = [&](const char* list, const char* name, double truth, double widest = 0.01) {
    const Estimate e = io::read_estimate(in.at(list).at(name));
    EXPECT_NEAR(e.value, truth, 4 * e.sd + 0.002 * std::abs(truth)) << name;
    EXPECT_LT(e.sd, widest * std::abs(truth)) << name;
  };
  check("parameters", "K1", 8500);
  check("parameters", "K2", 1.5e7);
  check("parameters", "C", 1.5);
  // The balanced rotor's unbalance and the screw's: mass times eccentricity, mass times radius. The lasers read runout,
  // which may as well be a bow of 10 um: the interval of e covers both readings, 10 um of 319 um.
  check("reported", "m*e", std::abs(std::polar(1.5 * 51.3e-6, 0.6) + 5e-3 * 82.73e-3), 0.025);
  // The isotropic derivation does not fit this machine, and says so.
  const Outcome isotropic = folder.whirl("derive " + example("rotor.toml") + " --model model.json");
  EXPECT_EQ(isotropic.exit_code, 2);
  EXPECT_NE(isotropic.err.find("less symmetric"), std::string::npos) << isotropic.err;
}

/// Two masses on springs driven by a multisine force, with 0.3 % noise: t_s, x1_m, x2_m, u_N.
std::string two_mass_record(const std::array<double, 6>& p) {
  const auto [m1, m2, k1, k2, c1, c2] = p;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> phase(0, 6.28);
  std::vector<double> phases(40);
  for (double& x : phases) x = phase(random);
  const auto force = [&](double t) {
    double u = 0;
    for (std::size_t k = 0; k < phases.size(); ++k)
      u += 0.5 * std::sin(6.283185307179586 * (0.5 + 0.25 * static_cast<double>(k)) * t + phases[k]);
    return u;
  };
  using State = Eigen::Vector4d;  // x1, x1', x2, x2'
  const auto rate = [&](double t, const State& s) {
    const double link = k2 * (s[2] - s[0]) + c2 * (s[3] - s[1]);
    return State(s[1], (link - k1 * s[0] - c1 * s[1]) / m1, s[3], (force(t) - link) / m2);
  };
  State s = State::Zero();
  std::normal_distribution<double> normal;
  const double dt = 1e-3;
  std::string text = "t_s,x1_m,x2_m,u_N\n";
  for (int i = 0; i < 12000; ++i) {
    const double t = i * dt;
    text += fmt::format("{},{},{},{}\n", t, s[0] + 5e-5 * normal(random), s[2] + 8e-5 * normal(random), force(t));
    const State a = rate(t, s), b = rate(t + dt / 2, s + dt / 2 * a), c = rate(t + dt / 2, s + dt / 2 * b),
                d = rate(t + dt, s + dt * c);
    s += dt / 6 * (a + 2 * b + 2 * c + d);
  }
  return text;
}

// Energies to library, record and library to model, model to the six parameters: the whole way by files.
TEST(DeriveE2e, LibraryFitsARecordAndThePhysicalParametersComeBack) {
  const Folder folder;
  const std::array<double, 6> truth{1.2, 0.4, 900, 500, 1.5, 0.3};
  folder.write("two.csv", two_mass_record(truth));
  ASSERT_EQ(folder.whirl("derive " + example("two_mass.toml") + " --out library.toml").exit_code, 0);
  const Outcome fitted = folder.whirl(
      "identify two.csv --library library.toml --states x1,x2 --inputs u --order 2 --out model.json --quiet");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const Outcome found = folder.whirl("derive " + example("two_mass.toml") + " --model model.json --json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const io::Json document = io::parse_json(found.out, "stdout");
  const char* names[] = {"m1", "m2", "k1", "k2", "c1", "c2"};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const Estimate e = io::read_estimate(io::JsonReader(document, "stdout").at("parameters").at(names[i]));
    EXPECT_NEAR(e.value, truth[i], 0.01 * truth[i]) << names[i];
    EXPECT_NEAR(e.value, truth[i], 5 * e.sd) << names[i];
  }
}

TEST(DeriveE2e, FaultsNameFileAndReason) {
  const Folder folder;
  const auto fault = [&](const std::string& text) {
    folder.write("s.toml", text);
    const Outcome outcome = folder.whirl("derive s.toml");
    EXPECT_EQ(outcome.exit_code, 2) << text;
    EXPECT_EQ(outcome.err.find("whirl: error: s.toml"), 0u) << outcome.err;
    return outcome.err;
  };
  EXPECT_NE(fault("coordinates = [\"x\"]\nkinetic = \"m*x'^2/2\"\n").find("'m' is not declared"), std::string::npos);
  EXPECT_NE(fault("coordinates = [\"x\"]\nkinetic = \"m*x'^2/2\"\n[parameters]\nm = \"2 lbs\"\n").find("s.toml:4"),
            std::string::npos);
  EXPECT_NE(fault("coordinates = [\"x\"]\nkinetc = \"m*x'^2/2\"\n").find("kinetc"), std::string::npos);
  EXPECT_NE(fault("kinetic = \"1\"\n").find("at least one"), std::string::npos);
  EXPECT_NE(fault("coordinates = [\"x\"]\nkinetic = \"m*x'^2/(2\"\n[parameters]\nm = \"kg\"").find("kinetic energy"),
            std::string::npos);
}

}  // namespace
}  // namespace whirl::testing
