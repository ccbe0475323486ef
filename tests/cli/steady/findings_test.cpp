// What `whirl info`, `whirl report` and `whirl plot` say of a motor whose 2X stands beside twice the line frequency.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "../program.hpp"

namespace whirl::testing {
namespace {

/// Ten seconds at 49.3 Hz: 1X 12 um, 2X of `second` um at 98.6 Hz, an electric line of 9 um at 100 Hz, a little noise.
std::string motor_beside_the_line(double second) {
  constexpr double kTurn = 2 * std::numbers::pi;
  std::string text = "t_s,x_um,beta_rad\n";
  unsigned state = 1;
  for (int i = 0; i < 10000; ++i) {
    const double t = i / 1000.0, turn = kTurn * 49.3 * t;
    state = state * 1664525U + 1013904223U;
    const double noise = static_cast<double>(state >> 8) / 16777216.0 - 0.5;
    const double x = 12 * std::cos(turn) + second * std::cos(2 * turn + 1) + 9 * std::cos(kTurn * 100 * t) + noise;
    char line[120];
    std::snprintf(line, sizeof line, "%.3f,%.8g,%.12g\n", t, x, turn);
    text += line;
  }
  return text;
}

TEST(FindingsE2e, InfoNames2XAndTheElectricLineBesideIt) {
  const Folder folder;
  folder.write("motor.csv", motor_beside_the_line(18));
  const Outcome o = folder.whirl("info motor.csv");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  for (const char* said : {"1X 12.0 µm peak", "2X 18.0 µm peak, exceeds 1X: 1.5 times 1X",
                           "twice the line frequency 100.00 Hz ", "chance under noise", "misalignment"})
    EXPECT_NE(o.out.find(said), std::string::npos) << said << "\n" << o.out;
  const std::string line = "twice the line frequency 100.00 Hz ";
  EXPECT_NEAR(std::stod(o.out.substr(o.out.find(line) + line.size())), 9, 0.02) << o.out;
  const Outcome json = folder.whirl("info motor.csv --json");
  for (const char* said : {"\"code\": \"second_order\"", "\"code\": \"twice_line_frequency\"", "\"kind\": \"peak\"",
                           "\"may_mean\"", "\"not_judged\""})
    EXPECT_NE(json.out.find(said), std::string::npos) << said << "\n" << json.out;
}

TEST(FindingsE2e, AReportOpensWithTheVerdictAndSaysThat2XExceeds1X) {
  const Folder folder;
  folder.write("motor.csv", motor_beside_the_line(18));
  folder.write("fan.toml",
               "[machine]\nname = \"Fan 3\"\n[measurement]\ndate = \"2026-05-04\"\nanalyst = \"A. Weber\"\n");
  const Outcome o = folder.whirl("report motor.csv --out page.html --about fan.toml");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const std::string page = slurp(folder / "page.html");
  const auto verdict = page.rfind(">Verdict</h2>"), findings = page.rfind(">Findings</h2>");
  ASSERT_NE(verdict, std::string::npos);
  ASSERT_NE(findings, std::string::npos);
  EXPECT_LT(verdict, findings);
  const std::string table = page.substr(verdict, findings - verdict);
  for (const char* said : {"Fan 3", "2026-05-04", "A. Weber", "ISO 20816-3", "exceeds 1X", "alignment"})
    EXPECT_NE(table.find(said), std::string::npos) << said << "\n" << table;
}

TEST(FindingsE2e, OrdersDrawNo2XOfAPurelyElectricLine) {
  const Folder folder;
  folder.write("motor.csv", motor_beside_the_line(0));
  const Outcome drawn = folder.whirl("plot motor.csv --what orders --out orders.svg");
  ASSERT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_NE(slurp(folder / "orders.svg").find("electric line of 100.00 Hz taken off"), std::string::npos);
  EXPECT_EQ(folder.whirl("info motor.csv").out.find("2X"), std::string::npos);
}

}  // namespace
}  // namespace whirl::testing
