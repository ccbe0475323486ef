#include <gtest/gtest.h>

#include "program.hpp"

namespace whirl::testing {
namespace {

// A run-down of 600 samples that every reader accepts.
std::string good_record(int rows = 600) {
  std::string text = "t_s,x_mm,y_mm,beta_rad\n";
  for (int i = 0; i < rows; ++i) {
    text += std::to_string(i * 1e-3) + "," + std::to_string(0.1 * (i % 7)) + "," + std::to_string(0.1 * (i % 5)) + "," +
            std::to_string(0.1 * i) + "\n";
  }
  return text;
}

struct BadCall {
  const char* arguments;
  const char* message;  // part of what is printed on stderr
};

TEST(BadInputE2e, EveryWrongCallEndsWithCodeTwoAndOneClearSentence) {
  const Folder folder;
  folder.write("empty.csv", "");
  folder.write("no_unit.csv", "t_s,x,y_mm,beta_rad\n0,1,1,0\n0.001,1,1,0\n");
  folder.write("unknown_unit.csv", "t_s,x_furlong,y_mm,beta_rad\n0,1,1,0\n0.001,1,1,0\n");
  folder.write("nan.csv", "t_s,x_mm,y_mm,beta_rad\n0,1,1,0\n0.001,nan,1,0\n0.002,1,1,0\n");
  folder.write("jump.csv", "t_s,x_mm,y_mm,beta_rad\n0,1,1,0\n0.001,1,1,0\n0.005,1,1,0\n0.006,1,1,0\n");
  folder.write("no_beta.csv", "t_s,x_mm,y_mm\n0,1,1\n0.001,1,2\n0.002,1,1\n");
  folder.write("broken.json", "{\"schema\": \"whirl.model/1\", ");
  folder.write("newer.json", "{\"schema\": \"whirl.model/99\"}");
  folder.write("bad_rig.toml", "[rotor]\nmass_kg = -1.5\n");
  folder.write("typo_rig.toml", "[rotor]\nmas_kg = 1.5\n");
  folder.write("good.csv", good_record());
  const BadCall calls[] = {
      {"", "subcommand"},
      {"identfy x.csv", "identfy"},
      {"info missing.csv", "missing.csv"},
      {"info empty.csv", "empty.csv"},
      {"info no_unit.csv", "no_unit.csv:1"},
      {"info unknown_unit.csv", "furlong"},
      {"identify nan.csv", "nan.csv"},
      {"convert jump.csv c.csv", "jump.csv:4"},
      {"identify no_beta.csv", "beta"},
      {"identify good.csv --method magic", "magic"},
      {"validate broken.json good.csv", "broken.json"},
      {"validate newer.json good.csv", "newer"},
      {"design broken.json --out c.json", "broken.json"},
      {"run broken.json", "broken.json"},
      {"rig record --rig bad_rig.toml --out r.csv", "bad_rig.toml"},
      {"rig record --rig typo_rig.toml --out r.csv", "mas_kg"},
      {"modes good.csv", "good.csv"},
      {"stiffness good.csv", "deflection"},
  };
  for (const BadCall& call : calls) {
    const Outcome outcome = folder.whirl(call.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << call.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(call.message), std::string::npos) << call.arguments << "\n" << outcome.err;
    EXPECT_EQ(outcome.out.find("Segmentation"), std::string::npos);
  }
}

TEST(BadInputE2e, InfoShowsGapsInPlaceOfRefusingThem) {
  const Folder folder;
  std::string text = "t_s,x_mm,y_mm\n";
  for (int i = 0; i < 600; ++i) {
    if (i < 300 || i >= 310)
      text += std::to_string(i * 1e-3) + (i == 100 ? std::string(",,") : "," + std::to_string(0.1 * (i % 7)) + ",") +
              std::to_string(0.1 * (i % 5)) + "\n";
  }
  folder.write("gap.csv", text);
  const Outcome shown = folder.whirl("info gap.csv");
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  EXPECT_NE(shown.err.find("10 samples are missing"), std::string::npos) << shown.err;
  EXPECT_NE(shown.out.find("x: 11 of 600 values are missing"), std::string::npos) << shown.out;
  EXPECT_NE(shown.out.find("y: 10 of 600 values are missing"), std::string::npos) << shown.out;
  EXPECT_EQ(shown.out.find("nan"), std::string::npos) << shown.out;
}

TEST(BadInputE2e, ARecordThatCannotGiveARotorEndsWithCodeOneAndTheReason) {
  const Folder folder;
  folder.write("short.csv", good_record());
  const Outcome outcome = folder.whirl("identify short.csv --out model.json");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.err.find("not usable"), std::string::npos) << outcome.err;
}

TEST(HelpE2e, EverySubcommandTeachesWithAnExample) {
  const Folder folder;
  for (const char* command :
       {"info", "stiffness", "frf", "modes", "identify", "validate", "design", "run", "rig", "convert", "reproduce"}) {
    const Outcome outcome = folder.whirl(std::string(command) + " --help");
    EXPECT_EQ(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.out.find("Example: whirl"), std::string::npos) << command << "\n" << outcome.out;
  }
}

// Bytes that command a terminal, in names of files, flags and fields: none reaches it.
TEST(BadInputE2e, WhatCommandsATerminalIsNotPrinted) {
  const Folder folder;
  folder.write("good.csv", good_record());
  folder.write("field.json", "{\"schema\": \"whirl.model/1\", \"a\\u001b[2Jb\": 1}");
  folder.write("field.toml", "[rotor]\n\"k\\u001b[2J\" = 3\n");
  folder.write("value.csv", "t_s,x_mm,y_mm,beta_rad\n0,1,1,0\n0.001,\x1b[31m,1,0\n");
  folder.write("unit.csv", "t_s,x_\x1b[31m,y_mm,beta_rad\n0,1,1,0\n0.001,1,1,0\n");
  for (const char* call :
       {"info $(printf 'no\\033[31mfile.csv')", "identify good.csv $(printf -- '--meth\\033od') 1",
        "identify good.csv --method $(printf 'a\\033b')", "validate field.json good.csv",
        "rig record --rig field.toml --out r.csv", "info value.csv", "info unit.csv", "$(printf 'a\\033b')"}) {
    const Outcome outcome = folder.whirl(call);
    EXPECT_EQ(outcome.exit_code, 2) << call << "\n" << outcome.err;
    for (const std::string& text : {outcome.err, outcome.out})
      EXPECT_EQ(text.find('\x1b'), std::string::npos) << call << "\n" << text;
  }
}

}  // namespace
}  // namespace whirl::testing
