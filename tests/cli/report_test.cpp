#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "program.hpp"

namespace whirl::testing {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// A slow run-up from 15 to 35 Hz at 1 kHz through a resonance at 25 Hz with a damping ratio of 0.05, in mm.
std::string run_up() {
  std::string text = "t_s,x_mm,y_mm,beta_rad\n";
  for (int i = 0; i < 10000; ++i) {
    const double t = i / 1000.0, f = 15 + 2 * t, theta = kTurn * (15 * t + t * t);
    const std::complex<double> z = 0.02 * f * f / std::complex<double>(625 - f * f, 2.5 * f) * std::polar(1.0, theta);
    char line[120];
    std::snprintf(line, sizeof line, "%.3f,%.12g,%.12g,%.12g\n", t, z.real(), z.imag(), theta);
    text += line;
  }
  return text;
}

/// A closed-loop log in which the control takes nine tenths of the motion away.
std::string loop_log() {
  std::string text = "t_s,x_true_m,y_true_m,x_open_m,y_open_m,ux_N,uy_N,s_x_m_s,s_y_m_s,beta_rad,omega_rad_s\n";
  for (int i = 0; i < 6000; ++i) {
    const double t = i / 1000.0, f = 30 - 4 * t, theta = kTurn * (30 * t - 2 * t * t);
    const double x = 1e-3 * std::cos(theta), y = 1e-3 * std::sin(theta);
    char line[240];
    std::snprintf(line, sizeof line, "%.3f,%.9g,%.9g,%.9g,%.9g,%.6g,%.6g,0.01,0,%.9g,%.9g\n", t, 0.1 * x, 0.1 * y, x, y,
                  3e3 * x, 3e3 * y, theta, kTurn * f);
    text += line;
  }
  return text;
}

TEST(ReportE2e, OnePageOfRunsTablesAndALoopThatNeedsNothingElse) {
  const Folder folder;
  folder.write("runup.csv", run_up());
  folder.write("log.csv", loop_log());
  folder.write("bode.csv", "rpm,amp_um,phase_deg\n1000,1,0\n1100,3,-20\n1200,9,-90\n1300,4,-150\n1400,2,-170\n");
  const Outcome outcome =
      folder.whirl("report runup.csv log.csv bode.csv --service-rpm 1900 --out page.html --figures figures");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = slurp(folder / "page.html");
  EXPECT_LT(page.size(), 5'000'000U);
  for (const char* text : {"Run map", "Waterfall", "Cascade", "Bode plot", "Polar plot", "Orders followed", "Orbit",
                           "Critical speeds", "Shaft vibration zones", "not a statement of compliance",
                           "Segments by rotor speed", "Control force", "sha256:", "90.0 %"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  // Half power of a damping ratio of 0.05 is an amplification factor of 10; this curve is the steady one.
  EXPECT_TRUE(page.find(">10.0<") != std::string::npos || page.find(">9.9<") != std::string::npos ||
              page.find(">10.1<") != std::string::npos);
  for (const char* outside : {"src=\"http", "href=\"http", "<script ", "@import", "url(http"}) {
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  }
  EXPECT_TRUE(std::filesystem::exists(folder / "figures/figure_01.svg"));
  EXPECT_TRUE(std::filesystem::exists(folder / "figures/figure_01.csv"));
}

// The findings begin with what the standards say of the machine.
TEST(ReportE2e, FindingsNameZoneAndBalanceQualityFirst) {
  const Folder folder;
  folder.write("runup.csv", run_up());
  const std::string model = source_dir() + "/tests/data/schemas/model-1.json";
  folder.write("fan.toml", "[machine]\nname = \"Fan 3\"\n");
  const Outcome outcome = folder.whirl("report runup.csv '" + model + "' --out page.html --about fan.toml");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = slurp(folder / "page.html");
  const std::size_t begin = page.find(">Findings</h2>"), end = page.find(">Runs</h2>");
  ASSERT_LT(begin, end);
  const std::string findings = page.substr(begin, end - begin);
  EXPECT_LT(findings.find("of ISO 20816-3"), findings.find("of ISO 21940-11"));
  EXPECT_LT(findings.find("of ISO 21940-11"), findings.find("Model model-1.json"));
}

TEST(ReportE2e, PdfWhereABrowserIsInstalled) {
  if (std::system("command -v chromium >/dev/null") != 0)
    GTEST_SKIP() << "chromium is not installed (apt install chromium)";
  const Folder folder;
  folder.write("bode.csv", "rpm,amp_um,phase_deg\n1000,1,0\n1100,3,-20\n1200,9,-90\n1300,4,-150\n1400,2,-170\n");
  const Outcome outcome = folder.whirl("report bode.csv --out page.html --pdf page.pdf");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(slurp(folder / "page.pdf").substr(0, 5), "%PDF-");
}

// A stand-in for the browser says how it was called.
TEST(ReportE2e, TheBrowserRunsInItsSandboxAndWithoutOnlyWhereThereIsNone) {
  const Folder folder;
  namespace fs = std::filesystem;
  fs::permissions(folder / ".", fs::perms::all);
  fs::create_directory(folder / "bin");
  folder.write("bode.csv", "rpm,amp_um,phase_deg\n1000,1,0\n1100,3,-20\n1200,9,-90\n1300,4,-150\n1400,2,-170\n");
  for (const bool works : {true, false}) {
    fs::remove(folder / "calls.txt");
    folder.write("bin/chromium",
                 std::string("#!/bin/sh\necho \"$(id -u) $*\" >> ") + (folder / "calls.txt").string() +
                     "\nfor a; do case $a in --print-to-pdf=*) out=${a#*=};; --no-sandbox) bare=1;; esac; done\n" +
                     (works ? "" : "[ -n \"$bare\" ] || exit 1\n") + "printf '%%PDF-1.4\\n%%%%EOF\\n' > \"$out\"\n");
    fs::permissions(folder / "bin/chromium", fs::perms::all);
    const Outcome o = folder.shell("PATH=\"$PWD/bin:$PATH\" '" + program() +
                                   "' report bode.csv --out page.html --pdf page.pdf --force --quiet");
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const std::string calls = slurp(folder / "calls.txt");
    const std::string first = calls.substr(0, calls.find('\n'));
    EXPECT_EQ(first.find("--no-sandbox"), std::string::npos) << first;
    EXPECT_NE(first.substr(0, 2), "0 ") << "never as root";
    EXPECT_EQ(calls.find("--no-sandbox") != std::string::npos, !works) << calls;
    EXPECT_EQ(o.err.find("sandbox does not start") != std::string::npos, !works) << o.err;
    EXPECT_EQ(slurp(folder / "page.pdf").substr(0, 5), "%PDF-");
  }
}

// A flag says it for this report, the file for all of a machine.
TEST(ReportE2e, AFileAboutTheMachineGivesWhatNoFlagSays) {
  const Folder folder;
  folder.write("runup.csv", run_up());
  folder.write("fan.toml", "[machine]\nname = \"Fan <3>\"\nservice_rpm = 1480\niso_20816 = \"2-rigid\"\n");
  ASSERT_EQ(folder.whirl("report runup.csv --out by_file.html --about fan.toml").exit_code, 0);
  ASSERT_EQ(folder.whirl("report runup.csv --out by_flag.html --about fan.toml --service-rpm 1400").exit_code, 0);
  ASSERT_EQ(folder.whirl("report runup.csv --out flag.html --service-rpm 1480 --machine 2-rigid").exit_code, 0);
  const std::string by_file = slurp(folder / "by_file.html"), by_flag = slurp(folder / "by_flag.html"),
                    flag = slurp(folder / "flag.html");
  EXPECT_NE(by_file.find("Fan &lt;3&gt;"), std::string::npos);
  const auto rows = [](const std::string& page) { return page.substr(page.rfind(">Findings</h2>"), 2000); };
  EXPECT_EQ(rows(by_file), rows(flag));
  EXPECT_NE(rows(by_file), rows(by_flag));
  folder.write("fan.toml", "[machine]\niso_20816 = \"3-rigid\"\n");
  const Outcome wrong = folder.whirl("report runup.csv --out no.html --about fan.toml");
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("fan.toml:2: machine.iso_20816"), std::string::npos) << wrong.err;
  EXPECT_NE(wrong.err.find("2-flexible"), std::string::npos) << wrong.err;
}

TEST(ReportE2e, WhatCannotBeReportedIsRefused) {
  const Folder folder;
  folder.write("other.json", "{\"schema\": \"whirl.other/1\"}");
  folder.write("no_angle.csv", "t_s,x_mm\n0,1\n0.001,nan\n");
  for (const auto& [arguments, message] :
       {std::pair{"report other.json", "whirl.other/1"}, std::pair{"report no_angle.csv", "no_angle.csv:3"},
        std::pair{"report absent.csv", "absent.csv"}}) {
    const Outcome outcome = folder.whirl(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
