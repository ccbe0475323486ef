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

// Nothing to suppress: neither NaN nor infinite.
TEST(ExportE2e, APlantFmuWithoutUnbalanceHasNoSuppression) {
  const Folder folder;
  save_inputs(folder);
  IdentifiedModel still = io::load<IdentifiedModel>(folder / "model.json");
  still.rotor->eps = {0, 0};
  io::save(folder / "still.json", still);
  ASSERT_EQ(folder.whirl("export fmu still.json --mass-kg 1.5 --out . --prefix plant").exit_code, 0);
  const Outcome text = folder.whirl("run controller.json --fmu plant.fmu");
  EXPECT_NE(text.out.find("suppression not defined"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("nan"), std::string::npos) << text.out;
  const Outcome run = folder.whirl("run controller.json --fmu plant.fmu --json --quiet");
  const io::Json json = io::parse_json(run.out, "stdout");
  EXPECT_EQ(*json.find("open_peak")->get<double>(), 0);
  EXPECT_FALSE(json.find("suppression")->get<double>());
}

// Instructions, stack and flash of a step, counted in an emulator: supervision costs what it costs, and never twice the
// mean in a step.
TEST(ExportE2e, TargetCountsTheInstructionsOfAStep) {
  const Folder folder;
  save_inputs(folder);
  const Outcome plain = folder.whirl("export c controller.json --target cortex-m4f --out drive --json");
  if (plain.err.find("is not installed") != std::string::npos) GTEST_SKIP() << plain.err;
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_NE(slurp(folder / "drive/controller.h").find("typedef float"), std::string::npos);
  ControllerDesign d = io::load<ControllerDesign>(folder / "controller.json");
  d.parameters["supervise"] = 1;
  io::save(folder / "watched.json", d);
  const Outcome watched = folder.whirl("export c watched.json --target cortex-m4f --json");
  ASSERT_EQ(watched.exit_code, 0) << watched.err;
  const auto value = [](const Outcome& o, const char* key) {
    const std::size_t at = o.out.find(std::string("\"") + key + "\":");
    return at == std::string::npos ? -1 : std::atof(o.out.c_str() + at + std::string(key).size() + 3);
  };
  for (const Outcome* o : {&plain, &watched}) {
    EXPECT_GT(value(*o, "mean"), 300) << o->out;
    EXPECT_GE(value(*o, "worst"), value(*o, "mean"));
    EXPECT_LE(value(*o, "worst"), 2 * value(*o, "mean"));
    EXPECT_GT(value(*o, "stack"), 50);
    EXPECT_GT(value(*o, "flash"), 5000);
  }
  EXPECT_GT(value(watched, "mean"), value(plain, "mean"));
  EXPECT_GT(value(watched, "state"), value(plain, "state"));
}

TEST(ExportE2e, ATargetWithoutItsToolsSaysWhichPackageAndWritesNothing) {
  const Folder folder;
  save_inputs(folder);
  const std::string command = "cd '" + (folder / "").string() + "' && mkdir few && ln -s /bin/sh few/sh && PATH=few '" +
                              program() + "' export c controller.json --target cortex-m4f --out none 2>few/said";
  EXPECT_NE(std::system(command.c_str()), 0);
  EXPECT_NE(slurp(folder / "few/said").find("apt-get install gcc-arm-none-eabi"), std::string::npos)
      << slurp(folder / "few/said");
  EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

TEST(ExportE2e, ARefusedFloatLeavesNoFolder) {
  const Folder folder;
  save_inputs(folder);
  ControllerDesign d = io::load<ControllerDesign>(folder / "controller.json");
  d.law = "pd_influence";
  d.feedforward = false;
  io::save(folder / "turns.json", d);
  for (const char* form : {"c", "fmu", "python", "matlab", "sfunction"}) {
    const Outcome o = folder.whirl("export " + std::string(form) + " turns.json --float --out " + form);
    EXPECT_EQ(o.exit_code, 2) << form;
    EXPECT_FALSE(std::filesystem::exists(folder / form)) << form << ": " << o.err;
  }
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
                                                       {"fmu model.json --fmi 1", "fmi"},
                                                       {"fmu controller.json --target cortex-m4f", "form c"},
                                                       {"c model.json --target cortex-m4f", "a model"},
                                                       {"c controller.json --target z80", "cortex-m4f"}};
  for (const auto& [arguments, word] : wrong) {
    const Outcome outcome = folder.whirl("export " + std::string(arguments));
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_NE((outcome.err + outcome.out).find(word), std::string::npos) << arguments << ": " << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
