#include "whirl/io/library_toml.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

void expect_equal(const expr::CandidateLibrary& a, const expr::CandidateLibrary& b) {
  EXPECT_EQ(a.lhs, b.lhs);
  EXPECT_EQ(a.variables, b.variables);
  EXPECT_EQ(a.known, b.known);
  ASSERT_EQ(a.groups.size(), b.groups.size());
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    EXPECT_EQ(a.groups[g].name, b.groups[g].name);
    EXPECT_EQ(a.groups[g].coefficient, b.groups[g].coefficient);
    EXPECT_EQ(a.groups[g].unit, b.groups[g].unit);
    ASSERT_EQ(a.groups[g].entries.size(), b.groups[g].entries.size()) << a.groups[g].name;
    for (std::size_t k = 0; k < a.groups[g].entries.size(); ++k) {
      EXPECT_EQ(a.groups[g].entries[k].equation, b.groups[g].entries[k].equation);
      EXPECT_EQ(a.groups[g].entries[k].function, b.groups[g].entries[k].function);
      EXPECT_EQ(a.groups[g].entries[k].factor, b.groups[g].entries[k].factor);
    }
  }
}

TEST(LibraryToml, HandWrittenFileGivesGroupsTermsAndKnownParts) {
  const expr::CandidateLibrary library = parse_library_toml(R"(
equations = ["x''", "y''"]
common = ["x'", "1"]
[terms]
"x''" = ["x^3", "x'"]
[known]
"y''" = "-9.81"
[[group]]
name = "k1"
coefficient = "K1/m"
unit = "1/s^2"
terms = ["-x", "-2*y"]
)",
                                                            "library.toml");
  ASSERT_EQ(library.groups.size(), 6u);
  EXPECT_EQ(library.groups[0].name, "k1");
  EXPECT_EQ(library.groups[0].entries[1].factor, -2);
  EXPECT_EQ(library.groups[0].entries[1].function, expr::Expr::symbol("y"));
  const char* untied[] = {"x'", "1", "x^3", "x'", "1"};
  const std::size_t equation[] = {0, 0, 0, 1, 1};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(library.groups[i + 1].name, untied[i]);
    EXPECT_EQ(library.groups[i + 1].entries[0].equation, equation[i]);
  }
  EXPECT_EQ(library.known, (std::vector<expr::Expr>{expr::Expr(0), expr::Expr(-9.81)}));
  EXPECT_EQ(library.variables, (std::vector<std::string>{"x", "x'", "y"}));
}

TEST(LibraryToml, WithoutEquationsTheOnesSoughtAreTaken) {
  const expr::CandidateLibrary library = parse_library_toml("common = [\"1\", \"x\"]", "l", {"x'", "y'"});
  EXPECT_EQ(library.lhs, (std::vector<std::string>{"x'", "y'"}));
  EXPECT_EQ(library.groups.size(), 4u);
  EXPECT_THROW((void)parse_library_toml("common = [\"1\"]", "l"), Error);
}

TEST(LibraryToml, RotorLibrariesRoundTrip) {
  for (const bool more : {false, true}) {
    const expr::CandidateLibrary tied = expr::tied_rotor_library(true, more, more);
    expect_equal(parse_library_toml(to_toml(tied, {"rotor"}), "l"), tied);
  }
}

TEST(LibraryTomlProperty, RandomTiedLibrariesRoundTrip) {
  std::mt19937_64 random(5);
  const char* pool[] = {"x",       "y'", "x^2*y",         "sin(b)", "b'^2*cos(b) + b''*sin(b)",
                        "sgn(x')", "0",  "-0.3*x*abs(x)", "2.5e-7"};
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<expr::TiedGroup> groups;
    for (std::size_t g = 0; g < 1 + random() % 4; ++g) {
      std::vector<expr::Expr> places;
      for (int i = 0; i < 3; ++i) places.push_back(expr::Expr::parse(pool[random() % std::size(pool)]));
      if (expr::tied_group("", places).entries.empty()) places[0] = expr::Expr(1);
      groups.push_back(expr::tied_group(fmt::format("g{}", g), places, g % 2 ? "K/m" : "", "1/s^2"));
    }
    const expr::CandidateLibrary library =
        expr::make_library({"x''", "y''", "w'"}, groups, {expr::Expr(0), expr::Expr::parse("-9.81*x"), expr::Expr(1)});
    expect_equal(parse_library_toml(to_toml(library), "l"), library);
  }
}

TEST(LibraryToml, FaultsAreNamedWithTheirPlace) {
  const auto message = [](const char* text) -> std::string {
    try {
      (void)parse_library_toml(text, "l.toml");
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_NE(message("equations = [\"x'\"]\ncommon = [\"x^\"]").find("l.toml:2"), std::string::npos);
  EXPECT_NE(message("equations = [\"x'\"]\n[terms]\n\"y'\" = [\"x\"]").find("y'"), std::string::npos);
  EXPECT_NE(message("equations = [\"x'\"]").find("no candidate"), std::string::npos);
  EXPECT_NE(message("equations = [\"x'\", \"y'\"]\n[[group]]\nterms = [\"x\"]").find("one for each of the 2"),
            std::string::npos);
  EXPECT_NE(message("equations = [\"x'\"]\n[[group]]\nterms = [\"0\"]").find("0 everywhere"), std::string::npos);
  EXPECT_NE(message("equations = [\"x'\"]\n[[group]]\nunit = \"m//s\"\nterms = [\"x\"]").find("l.toml:3"),
            std::string::npos);
  EXPECT_NE(message("equations = [\"x'\", \"x'\"]\ncommon = [\"x\"]").find("twice"), std::string::npos);
}

}  // namespace
}  // namespace whirl::io
