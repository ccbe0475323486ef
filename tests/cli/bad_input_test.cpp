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

// A column of the right name in a wrong unit: volts are no newtons, grams of force no grams.
TEST(BadInputE2e, EveryTableSaysByQuantityWhatItTakes) {
  const Folder folder;
  const auto balance = [&](const std::string& name, const std::string& header) {
    folder.write(name, "run_1," + header + "\n1,1500,50,40,0,0\n2,1500,60,110,10,0\n3,1500,50,41,0,0\n");
  };
  folder.write("kg.csv", "deflection_mm,force_kg\n0,0\n0.2,0.21\n0.4,0.43\n0.6,0.65\n");
  folder.write("V.csv", "deflection_V,force_N\n0,0\n0.2,2.1\n0.4,4.3\n0.6,6.5\n");
  balance("N.csv", "speed_rpm,A_amp_um,A_phase_deg,P_mass_N,P_angle_deg");
  balance("um.csv", "speed_rpm,A_amp_um,A_phase_um,P_mass_gram,P_angle_deg");
  balance("mm.csv", "speed_mm,A_amp_um,A_phase_deg,P_mass_gram,P_angle_deg");
  balance("hz.csv", "speed_Hz,A_amp_um,A_phase_deg,P_mass_gram,P_angle_deg");
  folder.write("sine_kg.csv", "frequency_Hz,force_kg,amplitude_mm,phase_deg\n17,5,1,-4\n18,5,2,-9\n");
  folder.write("sine_s.csv", "frequency_s,force_N,amplitude_mm,phase_deg\n17,5,1,-4\n18,5,2,-9\n");
  folder.write("amp.csv", "rpm,amp_1x_kg,phase_1x_deg\n600,1,0\n700,2,1\n800,3,2\n");
  folder.write("speed.csv", "speed_mm,amp_1x_um,phase_1x_deg\n600,1,0\n700,2,1\n800,3,2\n");
  std::string swept = "t_s,force_V,x_mm\n", turns = "t_s,x_mm,y_mm,beta_mm\n";
  for (int i = 0; i < 600; ++i) {
    swept += std::to_string(1e-3 * i) + "," + std::to_string(i % 7) + "," + std::to_string(i % 5) + "\n";
    turns += std::to_string(1e-3 * i) + "," + std::to_string(i % 7) + ",1," + std::to_string(0.1 * i) + "\n";
  }
  folder.write("swept.csv", swept), folder.write("turns.csv", turns);
  const BadCall calls[] = {
      {"stiffness kg.csv", "kg.csv:1: column 'force_kg' is a mass, must be a force; allowed units: N"},
      {"stiffness V.csv", "column 'deflection_V' is a voltage, must be a displacement"},
      {"balance N.csv --angles against", "N.csv:1: column 'P_mass' is a force, must be a mass; allowed units: kg"},
      {"balance um.csv", "column 'A_phase' is a displacement, must be an angle; allowed units: rad"},
      {"balance mm.csv", "column 'speed' is a displacement, must be an angular velocity"},
      {"sine sine_kg.csv", "column 'force_kg' is a mass, must be a force"},
      {"sine sine_s.csv", "column 'frequency_s' is a time, must be a frequency"},
      {"transient amp.csv", "column 'amp_1x' is a mass, must be a displacement"},
      {"transient speed.csv", "column 'speed' is a displacement, must be an angular velocity"},
      {"transient amp.csv --amplitude-column amp_1x", "column 'amp_1x' is a mass, must be a displacement"},
      {"sine swept.csv", "column 'force' is a voltage, must be a force"},
      {"plot turns.csv --what bode", "beta is a displacement, must be an angle"},
      {"plot amp.csv --what bode", "column 'amp_1x' is a mass, must be a displacement"},
  };
  for (const BadCall& call : calls) {
    const Outcome outcome = folder.whirl(call.arguments);
    EXPECT_EQ(outcome.exit_code, 2) << call.arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(call.message), std::string::npos) << call.arguments << "\n" << outcome.err;
  }
  const Outcome hertz = folder.whirl("balance hz.csv --phase lag --amplitude pp --angles against");
  EXPECT_NE(hertz.out.find("90000 rpm"), std::string::npos) << hertz.out << hertz.err;
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
