// What the program says to a command line that it cannot follow: one sentence, code 2, nothing written.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <set>
#include <sstream>

#include "made_files.hpp"

namespace whirl::testing {
namespace {

/// One sentence that begins as every error does.
void expect_refused(const Outcome& outcome, const std::string& call, const std::string& part) {
  EXPECT_EQ(outcome.exit_code, 2) << call << "\n" << outcome.err;
  EXPECT_EQ(outcome.err.rfind("whirl: error: ", 0), 0U) << call << "\n" << outcome.err;
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << call << "\n" << outcome.err;
  EXPECT_NE(outcome.err.find(part), std::string::npos) << call << "\n" << outcome.err;
}

std::vector<std::string> matches(const std::string& text, const std::string& pattern) {
  std::vector<std::string> found;
  const std::regex expression(pattern);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_search(line, match, expression)) found.push_back(match[1]);
  }
  return found;
}

// No flag of any subcommand takes what is no number, in whatever way it is none.
TEST(MisuseE2e, WhatIsNoNumberIsRefusedByEveryFlagThatTakesOne) {
  const Folder folder;
  std::vector<std::string> commands;
  for (const std::string& name : matches(folder.whirl("--help").out, "^  ([a-z]+) +[A-Z]")) {
    const std::vector<std::string> below = matches(folder.whirl(name + " --help").out, "^  ([a-z]+)  +[A-Z]");
    if (below.empty()) commands.push_back(name);
    for (const std::string& child : below) commands.push_back(name + " " + child);
  }
  ASSERT_GE(commands.size(), 30U);
  int flags = 0;
  for (const std::string& command : commands) {
    Outcome help = folder.whirl(command + " --help-all");
    if (help.exit_code != 0) help = folder.whirl(command + " --help");
    for (const std::string& flag : matches(help.out, "^  (--[a-z0-9N-]+) (?:INT|UINT|FLOAT)")) {
      const char* none[] = {"nan", "5mm", "1e", "-inf", "''", "0x1p99999"};
      const std::string call = command + " " + flag + "=" + none[flags % 6];
      expect_refused(folder.whirl(call), call, "whirl: error: " + flag);
      ++flags;
    }
  }
  EXPECT_GE(flags, 150);
}

// "+10%" of what? The message says how to write a share, a change and a factor.
TEST(MisuseE2e, APercentageIsAnsweredWithTheNumberToWrite) {
  const Folder folder;
  for (const char* call :
       {"response m.json --at-rpm +10%", "balance r.csv --noise 5%", "rotor modes r.toml --speed-rpm +10%"}) {
    const Outcome outcome = folder.whirl(call);
    EXPECT_EQ(outcome.exit_code, 2) << call;
    EXPECT_NE(outcome.err.find("10 % above 1500 is 1650"), std::string::npos) << call << "\n" << outcome.err;
  }
}

TEST(MisuseE2e, EveryWrongWordIsNamedWithWhatIsAllowed) {
  const Folder folder;
  copy_made(folder);
  const std::pair<const char*, const char*> calls[] = {
      {"", "subcommand is missing; see whirl --help"},
      {"rig", "subcommand is missing; see whirl rig --help"},
      {"Info record.csv", "no subcommand 'Info', did you mean 'info'?"},
      {"record.csv", "'record.csv' is a file, not a command; what it holds: whirl info record.csv"},
      {"info", "FILE is missing; see whirl info --help"},
      {"info record.csv pull.csv", "not expected: pull.csv; see whirl info --help"},
      {"info --josn record.csv", "no flag '--josn', did you mean '--json'?"},
      {"plot record.csv --what", "--what: its value is missing"},
      {"rig record", "--out is missing"},
      {"export d controller.json", "FORM = d: must be one of c, fmu, python"},
      {"export fmu controller.json --fmi 4", "--fmi = 4: must be one of 2, 3"},
      {"frf blow_1.csv --estimator h4", "--estimator = h4: must be one of h1, h2, hv"},
      {"identify record.csv --method wek", "did you mean 'weak'?"},
      {"monitor record.csv --port 99999", "--port = 99999: must be between 0 and 65535"},
      {"response model.json --from-rpm 300rpm --to-rpm 1900",
       "--from-rpm = 300rpm: must be a finite number, without a "},
      {"response model.json --from-rpm 300,5 --to-rpm 1900",
       "must be a finite number, with a point before its decimals"},
      {"modes record.csv --select 30,80", "with a point before its decimals; several are separated by spaces"},
      {"frf record.csv --exclude 1,2", "--exclude = 1,2: must be a whole number; several are separated by spaces"},
      {"robustness controller.json --samples 1,000", "--samples = 1,000: must be a whole number, without a comma"},
      {"run controller.json --seed -1", "--seed = -1: must be a whole number, not below 0"},
      {"margins controller.json model.json --speeds 2.5", "--speeds = 2.5: must be a whole number"},
      {"run controller.json --fmu none.fmu", "--fmu = none.fmu: must be a file that is there"},
      {"identify record.csv --degree 3 --library system.toml", "give one of them"},
      {"design model.json --mass-kg 1.5 --stiffness stiff.json", "give one of them"},
      {"simulate model.json --from-rpm 300 --to-rpm 1500", "--seconds is missing"},
  };
  for (const auto& [call, part] : calls) expect_refused(folder.whirl(call), call, part);
}

// A flag that would do nothing is no flag that was understood.
TEST(MisuseE2e, FlagsThatWouldDoNothingAreRefused) {
  const Folder folder;
  copy_made(folder);
  const std::pair<const char*, const char*> calls[] = {
      {"run controller.json --seconds 5", "--seconds is for --io"},
      {"run controller.json --record run.h5", "--record is for --io"},
      {"run controller.json --require-rt", "--require-rt is for --io"},
      {"run controller.json --fmu-name x=a", "--fmu-name is for --fmu"},
      {"validate model.json record.csv --added-um 5", "--unbalance added"},
      {"response model.json --from-rpm 300 --to-rpm 1900 --amplitude 2", "--amplitude is for --input or --base"},
      {"response model.json --from-rpm 300 --to-rpm 1900 --peak-figure p.svg", "--peak-figure is for --peaks-to"},
      {"runup model.json --from-rpm 300 --to-rpm 1900 --coulomb-nm 2", "belong to a drive"},
      {"balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800 --limit-gram 5", "--limit-gram is for"},
      {"balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800 --out new.json", "--out is for"},
      {"balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800 --planes A", "--planes is for --session"},
      {"identify record.csv --out ''", "--out = '': must be the name of a file"},
      {"info ''", "FILE = '': must be the name of a file"},
      {"identify record.csv record.csv", "record.csv: given twice"},
      {"frf blow_1.csv ./blow_1.csv", "blow_1.csv: given twice"},
      {"frf blow_1.csv --resolution-hz 1", "--resolution-hz is for shakers"},
      {"frf blow_1.csv --excitation shaker --duration-s 1", "--duration-s is for impacts"},
      {"frf blow_1.csv --force-channel acc_x", "'acc_x' is a acceleration: must be a force"},
      {"replay none.h5", "none.h5: cannot be opened: No such file or directory"},
  };
  for (const auto& [call, part] : calls) expect_refused(folder.whirl(call), call, part);
  EXPECT_FALSE(std::filesystem::exists(folder / "new.json"));
}

// A speed in Hz, a run taken for ambient motion, a plan that no rate keeps: said, with what to do or why.
TEST(MisuseE2e, WhatIsPossibleButUnlikelyIsDoubted) {
  const Folder folder;
  copy_made(folder);
  const Outcome report = folder.whirl("report record.csv --service-rpm 25 --out r.html");
  EXPECT_NE(report.err.find("is the service speed in Hz (1500 rpm)?"), std::string::npos) << report.err;
  const Outcome ambient = folder.whirl("oma record.csv");
  EXPECT_NE(ambient.err.find("`whirl transient record.csv` takes modes from"), std::string::npos) << ambient.err;
  // A machine in operation, whose speed wanders by 3 %, is no run.
  std::string wanders = "t_s,x_um,beta_rad\n";
  for (int i = 0; i < 8000; ++i) {
    const double t = 2e-3 * i, beta = 157 * (t - 0.03 / 2 * std::cos(2 * t));
    wanders += fmt::format("{:.4f},{:.4f},{:.6f}\n", t, std::sin(beta) + std::sin(1.0 * i * i), beta);
  }
  folder.write("wanders.csv", wanders);
  const Outcome operation = folder.whirl("oma wanders.csv");
  EXPECT_NE(operation.exit_code, 2) << operation.err;
  EXPECT_EQ(operation.err.find("the speed changes"), std::string::npos) << operation.err;
  EXPECT_NE(folder.whirl("transient record.csv").exit_code, 2);
  const Outcome plan = folder.whirl("runup model.json --from-rpm 300 --to-rpm 1900 --limit-mm 0.0001");
  EXPECT_EQ(plan.exit_code, 1) << plan.err;
  EXPECT_NE(plan.err.find("not usable: run-"), std::string::npos) << plan.err;
}

// Values at which nothing moves, beyond what a record shows, or too small for its samples.
TEST(MisuseE2e, EdgesOfARangeAreAnsweredOrRefused) {
  const Folder folder;
  copy_made(folder);
  const Outcome still = folder.whirl("runup model.json --from-rpm 0 --to-rpm 1900 --json");
  EXPECT_EQ(still.exit_code, 0) << still.err;
  const std::pair<const char*, const char*> calls[] = {
      {"runup model.json --from-rpm 300 --to-rpm 1900 --unbalance 0", "--unbalance = 0: must be between"},
      {"frf blow_1.csv --duration-s 1e-9", "duration = 1e-09 s: must be 0 (to the next impact) or"},
      {"oma record.csv --harmonic-hz 700", "tone = 700 Hz: must be above 0 and below 500 Hz"},
      {"decay record.csv --from 1e8", "from = 1e+08 s: must be between 0 and 14"},
      {"plot short.csv", "short.csv: 3 samples (the record lasts from 0 to 0.002 s): must be 16 or more"},
      {"identify short.csv", "short.csv: 3 samples: at least 16 are needed"},
      {"oma short.csv", "the record is too short: 3 samples"},
  };
  folder.write("short.csv", "t_s,x_mm,y_mm,beta_rad\n0,1,1,0\n0.001,2,1,0.1\n0.002,1,3,0.2\n");
  for (const auto& [call, part] : calls) expect_refused(folder.whirl(call), call, part);
  // A dead sensor: its spectra are left out of the report with the reason, the rest is there.
  std::string dead = "t_s,x_mm,y_mm,beta_rad\n";
  for (int i = 0; i < 3000; ++i) dead += std::to_string(1e-3 * i) + ",0,0," + std::to_string(0.1 * i) + "\n";
  folder.write("dead.csv", dead);
  const Outcome report = folder.whirl("report dead.csv --out dead.html");
  EXPECT_EQ(report.exit_code, 0) << report.err;
  EXPECT_NE(slurp(folder / "dead.html").find("the signal is constant"), std::string::npos);
}

// `ulimit -f` ends a write, not the program: an error with the file's name, the old file and no part of a new one.
TEST(MisuseE2e, AFileSizeLimitIsAnErrorLikeAFullDisk) {
  const Folder folder;
  copy_made(folder);
  folder.write("old.csv", slurp(folder / "record.csv"));
  const std::string before = slurp(folder / "old.csv");
  const Outcome outcome = folder.whirl("--version; ulimit -f 100; '" + program() + "' rig record --out old.csv");
  expect_refused(outcome, "rig record", "old.csv: cannot be written: File too large");
  EXPECT_EQ(slurp(folder / "old.csv"), before);
  for (const auto& file : std::filesystem::directory_iterator(folder / "."))
    EXPECT_NE(file.path().extension(), ".part") << file.path();
}

}  // namespace
}  // namespace whirl::testing
