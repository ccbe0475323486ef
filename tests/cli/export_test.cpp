#include <gtest/gtest.h>

#include "program.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

RotorModel rotor() {
  RotorModel m;
  m.k1 = 5700;
  m.k2 = 1e7;
  m.c = 1;
  m.eps = {280e-6, 40e-6};
  m.gain = 1 / 1.5;
  return m;
}

void save_inputs(const Folder& folder) {
  ControllerDesign d;
  d.law = "tsmc";
  d.estimator = "kfe";
  d.model = rotor();
  d.delay = 2.05e-3;
  d.force_limit = 40;
  io::save(folder / "controller.json", d);
  IdentifiedModel m;
  m.method = "weak";
  m.rotor = rotor();
  m.rotor->gain = 0;
  io::save(folder / "model.json", m);
}

TEST(ExportE2e, C99OfControllerAndModelPassTheirSelfTests) {
  const Folder folder;
  save_inputs(folder);
  const Outcome controller = folder.whirl("export c controller.json --out drive --prefix drive");
  ASSERT_EQ(controller.exit_code, 0) << controller.err;
  EXPECT_NE(controller.out.find("make -C drive check"), std::string::npos) << controller.out;
  EXPECT_NE(slurp(folder / "drive/drive.c").find("controller.json sha256:"), std::string::npos);
  ASSERT_EQ(folder.whirl("export c model.json --mass-kg 1.5 --float --out plant").exit_code, 0);
  EXPECT_NE(slurp(folder / "plant/model.c").find("params->gain = 0.666666687F"), std::string::npos)
      << slurp(folder / "plant/model.c");
  for (const char* made : {"drive", "plant"}) {
    const std::string command =
        "make -C '" + (folder / made).string() + "' check >'" + (folder / "make.txt").string() + "' 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << slurp(folder / "make.txt");
  }
}

TEST(ExportE2e, FmuAndTheOtherFormsAreWritten) {
  const Folder folder;
  save_inputs(folder);
  const Outcome fmu = folder.whirl("export fmu model.json --fmi 3 --out . --prefix plant --json");
  ASSERT_EQ(fmu.exit_code, 0) << fmu.err;
  EXPECT_EQ(io::parse_json(fmu.out, "stdout").find("files")->get<io::Json::Array>()->size(), 1u);
  EXPECT_EQ(slurp(folder / "plant.fmu").substr(0, 2), "PK");
  ASSERT_EQ(folder.whirl("export fmu controller.json --out .").exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder / "controller.fmu"));
  const std::pair<const char*, const char*> forms[] = {
      {"python controller.json", "controller.py"},        {"python model.json", "model.py"},
      {"matlab controller.json", "controller_mex.c"},     {"matlab model.json", "model.m"},
      {"sfunction controller.json", "controller_sfun.c"}, {"modelica model.json", "Model.mo"},
      {"latex controller.json", "controller.tex"}};
  for (const auto& [arguments, file] : forms) {
    const Outcome outcome = folder.whirl("export " + std::string(arguments) + " --out forms");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(folder / "forms" / file)) << file;
  }
}

// The loop closed with an FMU as the plant: the same file that another tool would have made.
TEST(ExportE2e, PlantFmuIsARigOfTheControlLoop) {
  const Folder folder;
  save_inputs(folder);
  for (const char* version : {"2", "3"}) {
    ASSERT_EQ(folder.whirl("export fmu model.json --mass-kg 1.5 --out . --prefix plant --fmi " + std::string(version))
                  .exit_code,
              0);
    const Outcome run = folder.whirl("run controller.json --fmu plant.fmu --log run.csv --json --quiet");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const io::Json json = io::parse_json(run.out, "stdout");
    EXPECT_GT(*json.find("open_peak")->get<double>(), 1e-3);
    EXPECT_GT(*json.find("suppression")->get<double>(), 0.9);
    EXPECT_TRUE(std::filesystem::exists(folder / "run.csv"));
  }
  EXPECT_EQ(folder.whirl("run controller.json --fmu plant.fmu --fmu-name x=nothing").exit_code, 2);
  EXPECT_EQ(folder.whirl("run controller.json --rig model.json").exit_code, 2);
}

TEST(ExportE2e, WhatCannotBeExportedIsSaidInOneLine) {
  const Folder folder;
  save_inputs(folder);
  const std::pair<const char*, const char*> wrong[] = {{"modelica controller.json", "whirl export fmu"},
                                                       {"c controller.json --prefix 9x", "prefix"},
                                                       {"fmu controller.json --type me", "co-simulation"},
                                                       {"fmu model.json --float", "double"},
                                                       {"c none.json", "none.json"},
                                                       {"rust controller.json", "FORM"},
                                                       {"c controller.json --mass-kg 2", "belongs to a model"},
                                                       {"fmu model.json --fmi 1", "fmi"}};
  for (const auto& [arguments, word] : wrong) {
    const Outcome outcome = folder.whirl("export " + std::string(arguments));
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_NE((outcome.err + outcome.out).find(word), std::string::npos) << arguments << ": " << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
