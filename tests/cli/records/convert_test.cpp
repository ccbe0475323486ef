#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

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

/// A rotor at 25 Hz with four pulses a turn, evenly spaced: their number cannot be found from them.
std::string four_pulses() {
  std::string text = "t_s,x_mm,key_V\n";
  for (int i = 0; i < 4000; ++i) {
    const double turns = 25 * 1e-3 * i;
    text += std::to_string(1e-3 * i) + "," + std::to_string(0.05 * std::cos(2 * std::numbers::pi * turns)) + "," +
            (std::fmod(4 * turns, 1.0) < 0.3 ? "5" : "0") + "\n";
  }
  return text;
}

// `info` told users of --pulses and had no such flag.
TEST(InfoE2e, TheTachoMayBeStated) {
  const Folder folder;
  folder.write("a.csv", four_pulses());
  const Outcome outcome = folder.whirl("info a.csv --pulses key:4");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("at 1500 rpm"), std::string::npos) << outcome.out;
  EXPECT_NE(folder.whirl("info a.csv --pulses key:1").out.find("at 6000 rpm"), std::string::npos);
}

// Flags that did nothing for files that are no CSV table.
TEST(InfoE2e, EveryFlagHasItsEffectOrIsRefused) {
  const Folder folder;
  folder.write("a.csv", record());
  ASSERT_EQ(folder.whirl("convert a.csv b.h5").exit_code, 0);
  const Outcome some = folder.whirl("info b.h5 --columns acc:shaken_m_s2");
  EXPECT_EQ(some.exit_code, 0) << some.err;
  EXPECT_NE(some.out.find("1 channel,"), std::string::npos) << some.out;
  EXPECT_NE(some.out.find("shaken"), std::string::npos) << some.out;
  struct Call {
    const char *flags, *message;
  };
  for (const Call& call : {Call{"--columns acc:a_g", "is in m/s^2 by the file"},
                           {"--columns nosuch", "present: acc, force"},
                           {"--rate 50", "the rate given is 50 Hz"},
                           {"--header-line 3", "--header-line is for CSV files"},
                           {"--stream --columns acc", "state --rows"}}) {
    const Outcome outcome = folder.whirl(std::string("info b.h5 ") + call.flags);
    EXPECT_EQ(outcome.exit_code, 2) << call.flags << "\n" << outcome.out;
    EXPECT_NE(outcome.err.find(call.message), std::string::npos) << call.flags << "\n" << outcome.err;
  }
  EXPECT_EQ(folder.whirl("convert b.h5 c.csv --header-line 3").exit_code, 2);
}

// A hammer's record has transients: the largest line of its spectrum says nothing.
TEST(InfoE2e, ARecordOfBlowsHasNoLargestLine) {
  const Folder folder;
  const Outcome blow = folder.whirl("info " + source_dir() + "/examples/data/hammer.csv.gz");
  EXPECT_EQ(blow.exit_code, 0) << blow.err;
  EXPECT_NE(blow.out.find("no largest line"), std::string::npos) << blow.out;
  EXPECT_EQ(blow.out.find("at 18.25 Hz"), std::string::npos) << blow.out;
}

// Empty cells and rows that are left out: `info` took them, `convert` refused them and said to state the rate.
TEST(ConvertE2e, GapsStayGapsAndAreCounted) {
  const Folder folder;
  std::string text = "t_s,x_mm,y_mm\n";
  for (int i = 0; i < 400; ++i) {
    if (i >= 100 && i < 120) continue;
    text += std::to_string(1e-3 * i) + "," + (i >= 300 && i < 305 ? "" : std::to_string(std::sin(0.1 * i))) + ",1\n";
  }
  folder.write("a.csv", text);
  std::string from = "a.csv";
  for (const char* to : {"b.csv", "c.h5", "d.mat", "e.npz", "f.csv"}) {
    const Outcome outcome = folder.whirl("convert " + from + " " + to);
    ASSERT_EQ(outcome.exit_code, 0) << to << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find("x: 25 of 400 values are missing"), std::string::npos) << to << "\n" << outcome.err;
    EXPECT_NE(folder.whirl(std::string("info ") + to).out.find("x: 25 of 400 values are missing"), std::string::npos);
    from = to;
  }
  EXPECT_EQ(slurp(folder / "b.csv"), slurp(folder / "f.csv"));
  for (const char* to : {"g.wav", "h.lvm", "i.uff"}) {
    const Outcome outcome = folder.whirl(std::string("convert a.csv ") + to);
    EXPECT_EQ(outcome.exit_code, 2) << to;
    EXPECT_NE(outcome.err.find("has a place for missing values"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder / to)) << to;
  }
  EXPECT_EQ(folder.whirl("convert a.csv j.wav --rows 0:100").exit_code, 0);
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
