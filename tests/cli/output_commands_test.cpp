// Every subcommand that writes a file, under injected faults: a full disk, a failed flush and rename, a kill, missing
// memory. The commands whose formats differ stand in output_faults_test.cpp with more faults each.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <map>

#include "made_files.hpp"

namespace whirl::testing {
namespace {

namespace fs = std::filesystem;

struct Writer {
  const char* arguments;
  const char* file;
};

const Writer kWriters[] = {
    {"stiffness pull.csv --out o.json", "o.json"},
    {"stiffness pull.csv --figure o.svg", "o.svg"},
    {"frf blow_1.csv blow_2.csv --out o.json", "o.json"},
    {"modes frf.json --out o.json", "o.json"},
    {"derive system.toml --out o.toml", "o.toml"},
    {"identify record.csv --no-holdout --method paper --out o.json", "o.json"},
    {"validate model.json record.csv --out o.json", "o.json"},
    {"simulate model.json --from-rpm 300 --to-rpm 900 --seconds 1 --out o.csv", "o.csv"},
    {"design model.json --mass-kg 1.5 --hardware short.toml --law pd --estimator lpf --evaluations 1 --out o.json",
     "o.json"},
    {"run controller.json --log o.csv", "o.csv"},
    {"response model.json --from-rpm 300 --to-rpm 330 --out o.json", "o.json"},
    {"export c controller.json --prefix o --out out", "out/o.h"},
    {"export python controller.json --prefix o --out out", "out/o.py"},
    {"rig stiffness --out o.csv", "o.csv"},
    {"oma record.csv --rows 0:3000 --out o.json", "o.json"},
    {"decay decay.csv --out o.json", "o.json"},
    {"decay decay.csv --points o.json", "o.json"},
    {"balance runs.csv --phase lag --amplitude pp --angles against --slow-roll-rpm 400 --out o.json", "o.json"},
    {"balance runs.csv --phase lag --amplitude pp --angles against --slow-roll-rpm 400 --html o.html", "o.html"},
    {"robustness controller.json model.json --mass-kg 1.5 --samples 2 --out out", "out/robustness.json"},
    {"manual --out out", "out/whirl-identify.1"},
};

void try_faults(const Writer& w) {
  const Folder folder;
  copy_made(folder);
  folder.write("short.toml", "[profile]\nstart_rpm = 1500\nend_rpm = 900\nramp_s = 1\ndwell_end_s = 0\n");
  const auto with = [&](const std::string& environment) {
    return folder.shell(environment + " LD_PRELOAD='" + binary_dir() + "/tests/libwhirl_fault_shim.so' '" + program() +
                        "' " + w.arguments + " --force --quiet");
  };
  const Outcome sound = with("WHIRL_FAULT_COUNT=count.txt");
  ASSERT_LE(sound.exit_code, 1) << sound.err;
  ASSERT_TRUE(fs::exists(folder / w.file)) << sound.out << sound.err;
  const std::size_t good = slurp(folder / w.file).size();
  std::array<long, 4> n{}, line{};
  std::ifstream in(folder / "count.txt");
  while (in >> line[0] >> line[1] >> line[2] >> line[3])
    for (std::size_t i = 0; i < 4; ++i) n[i] = std::max(n[i], line[i]);
  ASSERT_GE(n[0], 1) << "no write was seen";
  ASSERT_GE(n[1], 1) << "nothing was flushed to the disk";
  const std::pair<const char*, long> faults[] = {{"enospc", n[0]}, {"eio", 1},       {"fsync", 1},
                                                 {"rename", 1},    {"memory", n[3]}, {"kill", n[0]}};
  int tried = 0, refused = 0;
  for (const auto& [kind, at] : faults) {
    if (at == 0) continue;
    ++tried;
    folder.write(w.file, "OLD");
    const Outcome o = with("WHIRL_FAULT=" + std::string(kind) + ":" + std::to_string(at));
    const std::string now = slurp(folder / w.file), what = std::string(kind) + "\n" + o.err;
    refused += o.exit_code > 1;
    if (o.exit_code <= 1) {
      EXPECT_GT(now.size(), 20u) << what << ": success, but no file";
    } else if (std::string(kind) == "kill") {
      EXPECT_EQ(o.exit_code, 137) << what;
      EXPECT_EQ(now.size() == 3 ? now : "whole", now.size() == 3 ? "OLD" : "whole") << what;
    } else {
      EXPECT_EQ(o.exit_code, 2) << what;
      // Memory may also be missing when the file is there and the rest of the answer is printed.
      const bool whole = std::string(kind) == "memory" && now.size() == good;
      EXPECT_EQ(whole ? "OLD" : now, "OLD") << what << ": destroyed";
      EXPECT_FALSE(o.err.empty()) << what;
    }
  }
  // What a kill left, the next run is not disturbed by.
  EXPECT_LE(with("").exit_code, 1);
  fmt::print("{}: {} faults, {} refused\n", w.arguments, tried, refused);
}

TEST(OutputCommandsE2e, AFaultIsToldAndTheOldFileStays) {
  for (const Writer& w : kWriters) {
    SCOPED_TRACE(w.arguments);
    try_faults(w);
  }
}

// The job file of a balancing session is read and written by every step: after a fault it is the one before or the one
// with the new run, and the job goes on.
TEST(OutputCommandsE2e, ABalancingSessionSurvivesEveryFault) {
  const Folder folder;
  ASSERT_EQ(folder
                .whirl("balance --session job.toml --planes A,B --probes DE,NDE --speeds-rpm 1500 --phase lag "
                       "--amplitude pp --angles against --trial-gram 10 --target-um 8 --probe-deg 45,45")
                .exit_code,
            0);
  const std::string before = slurp(folder / "job.toml"),
                    step = "balance --session job.toml --readings '48.43@7.2 46.28@60.2'";
  ASSERT_EQ(folder.whirl(step).exit_code, 0);
  const std::string after = slurp(folder / "job.toml");
  ASSERT_NE(after, before);
  int refused = 0;
  for (const char* fault : {"enospc:1", "eio:1", "fsync:1", "rename:1", "short:1", "eintr:1", "kill:1"}) {
    folder.write("job.toml", before);
    const Outcome o = folder.shell("WHIRL_FAULT=" + std::string(fault) + " LD_PRELOAD='" + binary_dir() +
                                   "/tests/libwhirl_fault_shim.so' '" + program() + "' " + step);
    refused += o.exit_code == 2;
    EXPECT_EQ(slurp(folder / "job.toml"), o.exit_code == 0 ? after : before) << fault << "\n" << o.err;
    folder.write("job.toml", before);
    EXPECT_EQ(folder.whirl(step).exit_code, 0) << "after " << fault;
  }
  EXPECT_GE(refused, 4);
}

// What is said where nobody can read it ends nothing: the exit code tells.
TEST(OutputCommandsE2e, AnErrorThatCannotBeSaidIsStillAnExitCode) {
  const Folder folder;
  for (const char* call : {"info nothere.csv 2>/dev/full", "info nothere.csv 2>&-"})
    EXPECT_EQ(folder.shell(fmt::format("'{}' {}", program(), call)).exit_code, 2) << call;
}

// A compiler at work when the signal comes: neither its folder nor half an FMU stays.
TEST(SignalE2e, AnEndedExportLeavesNoTemporaryFolder) {
  const Folder folder;
  copy_made(folder);
  fs::create_directory(folder / "tmp");
  std::map<std::string, int> stopped;
  for (const char* signal : {"TERM", "HUP", "INT"}) {
    for (const double after : {0.05, 0.15, 0.4}) {
      // `true;` ends the list that enters the folder: only the export goes to the background.
      const Outcome o = folder.shell(
          fmt::format("true; TMPDIR=\"$PWD/tmp\" env --default-signal=INT setsid '{}' export fmu controller.json "
                      "--out fmu --force & sleep {}; "
                      "kill -{} $!; wait $!; echo $? > code.txt; true",
                      program(), after, signal));
      (void)o;
      const int code = std::atoi(slurp(folder / "code.txt").c_str());
      EXPECT_TRUE(code == 0 || code > 128) << signal << " " << code;
      ++stopped[code > 128 ? signal : "none"];
      // The folder is removed by a program of its own.
      EXPECT_TRUE(await([&] { return fs::is_empty(folder / "tmp"); })) << signal << " after " << after << " s";
      for (const auto& file : fs::recursive_directory_iterator(folder / "."))
        EXPECT_NE(file.path().extension(), ".part") << file.path();
    }
  }
  for (const char* signal : {"TERM", "HUP", "INT"})
    EXPECT_GE(stopped[signal], 1) << signal << " came too late or did nothing";
}

}  // namespace
}  // namespace whirl::testing
