// What the loop's surroundings do to it: an stderr that cannot be written to, a terminal that is closed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "served.hpp"

namespace whirl::testing {
namespace {

using ::testing::HasSubstr;

/// Settings by which the system refuses something, which is said on stderr when the loop has started.
void refuse_a_processor(const Folder& folder) {
  std::string io = slurp(folder / "io.toml");
  const std::string key = "cpu = ";
  const std::size_t at = io.find(key);
  ASSERT_NE(at, std::string::npos);
  folder.write("io.toml", io.replace(at + key.size(), io.find('\n', at) - at - key.size(), "1000"));
}

TEST(LoopSurroundingsE2e, AnStderrThatFailsEndsNoLoop) {
  for (const char* where : {"2>/dev/full", "2>&1 >result.json | true"}) {
    const Folder folder;
    folder.write("rig.toml", kRig);
    io::save(folder / "controller.json", pd_design());
    const Served rig(folder, "--lockstep --rig rig.toml");
    rig.be_patient();
    refuse_a_processor(folder);
    const std::string whirl = "'" + program() + "' ";
    folder.shell("{ { " + whirl + "run controller.json --io io.toml --record run.h5 --seconds 1 --json" +
                 (std::string(where) == "2>/dev/full" ? " >result.json" : "") + "; echo $? >code.txt; } " + where +
                 "; }");
    EXPECT_EQ(slurp(folder / "code.txt"), "0\n") << where;
    const std::string result = slurp(folder / "result.json");
    EXPECT_THAT(result, HasSubstr("\"the time is over\"")) << where;
    EXPECT_THAT(result, HasSubstr("not bound to processor 1000")) << where;
  }
}

// A rig, because it ends by the same signals as a loop and needs nothing else.
TEST(LoopSurroundingsE2e, WhatIsStartedWithNohupOutlivesItsTerminal) {
  const Folder folder;
  folder.write("rig.toml", kRig);
  const std::string serve = "'" + program() + "' rig serve --lockstep --rig rig.toml --io io.toml --json ";
  // The program's place in the process table says what it does with SIGHUP, bit 0 of a signal mask.
  for (const bool ignored : {true, false}) {
    folder.shell("{ " + std::string(ignored ? "trap '' HUP; " : "") + serve +
                 ">serve.json & until [ -e io.toml ]; do sleep 0.05; done; sleep 0.1; kill -HUP $!; sleep 0.5; " +
                 "if kill -0 $! 2>/dev/null; then echo runs; kill -TERM $!; else echo ended; fi >after.txt; wait $!; " +
                 "rm io.toml; }");
    EXPECT_EQ(slurp(folder / "after.txt"), ignored ? "runs\n" : "ended\n");
  }
}

}  // namespace
}  // namespace whirl::testing
