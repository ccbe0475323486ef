#include <gtest/gtest.h>

#include <cmath>

#include "../program.hpp"

namespace whirl::testing {
namespace {

std::string record() {
  std::string text = "t_s,force_N,acc_g\n";
  for (int i = 0; i < 40; ++i)
    text +=
        std::to_string(0.01 * i) + "," + std::to_string(std::sin(0.3 * i)) + "," + std::to_string(0.1 * (i % 7)) + "\n";
  return text;
}

TEST(ConvertE2e, ARecordGoesThroughEveryFormatAndIsDescribed) {
  const Folder folder;
  folder.write("a.csv", record());
  std::string from = "a.csv";
  for (const char* to : {"b.mat", "c.h5", "d.wav", "e.lvm", "f.csv", "g.uff"}) {
    const Outcome outcome = folder.whirl("convert " + from + " " + to);
    ASSERT_EQ(outcome.exit_code, 0) << to << "\n" << outcome.err;
    const Outcome info = folder.whirl(std::string("info ") + to);
    EXPECT_EQ(info.exit_code, 0) << to << "\n" << info.err;
    EXPECT_NE(info.out.find("100 Hz"), std::string::npos) << to << "\n" << info.out;
    EXPECT_NE(info.out.find("m/s^2"), std::string::npos) << to << "\n" << info.out;
    from = to;
  }
}

TEST(ConvertE2e, WhatCannotBeReadOrWrittenEndsWithCodeTwo) {
  const Folder folder;
  folder.write("a.csv", record());
  folder.write("broken.mat", "MATLAB 5.0 MAT-file, but no more");
  folder.write("broken.uff", "    -1\n    58\nx\n");
  struct Call {
    const char *arguments, *message;
  };
  for (const Call& call : {Call{"convert a.csv b.xyz", ".lvm"},
                           {"convert broken.mat b.csv", "byte"},
                           {"info broken.uff", "broken.uff:3"},
                           {"convert missing.uff b.csv", "missing.uff"}}) {
    const Outcome outcome = folder.whirl(call.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << call.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(call.message), std::string::npos) << call.arguments << "\n" << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
