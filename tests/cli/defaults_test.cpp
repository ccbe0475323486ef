#include <gmock/gmock.h>

#include "program.hpp"

namespace whirl::testing {
namespace {

using ::testing::HasSubstr;

TEST(DefaultsE2e, AFolderHasDefaultsThatTheCommandLineOverrides) {
  const Folder folder;
  folder.write("whirl.toml",
               "[rig.record]\nadded_mass_g = 5\nsnr-db = 30\nquiet = false\n\n[plot]\nwhat = \"orbit\"\n");
  const Outcome taken = folder.whirl("rig record --out a.csv --snr-db 25");
  ASSERT_EQ(taken.exit_code, 0) << taken.err;
  EXPECT_THAT(taken.err, HasSubstr("from whirl.toml: --added-mass-g=5"));
  EXPECT_THAT(taken.err, ::testing::Not(HasSubstr("snr")));
  // The same record as with the flags written out.
  ASSERT_EQ(folder.whirl("rig record --out b.csv --snr-db 25 --added-mass-g 5 --quiet").exit_code, 0);
  EXPECT_EQ(slurp(folder / "a.csv"), slurp(folder / "b.csv"));
  EXPECT_EQ(folder.whirl("rig --help").err, "");
}

TEST(DefaultsE2e, AnotherFileOrNone) {
  const Folder folder;
  folder.write("mine.toml", "[rig.record]\nadded_mass_g = 5\n");
  folder.write("whirl.toml", "[rig.record]\nadded_mass_g = 7\n");
  EXPECT_THAT(
      folder.whirl("rig record --out a.csv; WHIRL_CONFIG=mine.toml " + program() + " rig record --out a.csv").err,
      HasSubstr("from mine.toml: --added-mass-g=5"));
  EXPECT_THAT(folder.whirl("--version; WHIRL_CONFIG= " + program() + " rig record --out a.csv").err,
              ::testing::Not(HasSubstr("from ")));
  EXPECT_EQ(folder.whirl("--version; WHIRL_CONFIG=no.toml " + program() + " rig record --out a.csv").exit_code, 2);
}

TEST(DefaultsE2e, WhatDoesNotExistIsRefusedWithFileAndLine) {
  const std::pair<const char*, const char*> cases[] = {
      {"[identify]\nhold_out = 0.2\n", "whirl.toml:2: whirl identify has no flag 'hold_out', did you mean 'holdout'?"},
      {"[identity]\n", "whirl.toml:1: whirl has no subcommand 'identity', did you mean 'identify'?"},
      {"[identify]\nquiet = 3\n", "whirl.toml:2: --quiet is a switch: true or false"},
      {"[identify]\nholdout = [1, 2]\n", "whirl.toml:2: --holdout takes one value"},
      {"[identify]\nholdout = 1979-05-27\n", "whirl.toml:2: --holdout must be text"},
      {"[identify\n", "whirl.toml:1"},
  };
  const Folder folder;
  for (const auto& [text, message] : cases) {
    folder.write("whirl.toml", text);
    const Outcome outcome = folder.whirl("info whirl.toml");
    EXPECT_EQ(outcome.exit_code, 2) << text;
    EXPECT_THAT(outcome.err, HasSubstr(message));
  }
}

}  // namespace
}  // namespace whirl::testing
