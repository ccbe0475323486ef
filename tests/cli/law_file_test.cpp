#include <gtest/gtest.h>

#include "program.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

constexpr const char* kPlantOfLaw = R"({"schema": "whirl.plant/1",
  "A": [[0, 1], [-5685, -1.5]], "B": [[0], [0.6667]], "C": [[1, 0]], "eccentricity_m": 3e-4})";
// A PD with its derivative filtered at 1000 1/s.
constexpr const char* kLaw = R"({"schema": "whirl.law/1", "x": {"num": [-100, -2000], "den": [0.001, 1]}})";

TEST(LawFileE2e, ALawOfTheUserIsCertifiedRunAndExported) {
  Folder folder;
  folder.write("plant.json", kPlantOfLaw);
  folder.write("law.json", kLaw);
  const Outcome designed = folder.whirl("design plant.json --law-file law.json --evaluations 6 --out c.json --quiet");
  ASSERT_EQ(designed.exit_code, 0) << designed.err;
  const ControllerDesign design = io::load<ControllerDesign>(folder / "c.json");
  EXPECT_EQ(design.law, "state_space");
  EXPECT_EQ(design.margins.at("certified"), 1);
  // s = 2000 (z - 1)/(z + 1) in 1/(0.001 s + 1): pole (2 - 1)/(2 + 1).
  EXPECT_NEAR(design.parameters.at("x_a_1_1"), 1.0 / 3, 1e-15);
  const Outcome margins = folder.whirl("margins c.json plant.json --speeds 3");
  EXPECT_EQ(margins.exit_code, 0);
  EXPECT_NE(margins.out.find("further delay as delivered: "), std::string::npos) << margins.out;
  EXPECT_NE(margins.out.find("limited by: "), std::string::npos) << margins.out;
  EXPECT_EQ(folder.whirl("robustness c.json plant.json --samples 16 --limit-mm 0.1 --quiet --out study").exit_code, 0);
  const Outcome run = folder.whirl("run c.json --quiet");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Outcome c = folder.whirl("export c c.json --out code");
  EXPECT_EQ(c.exit_code, 0) << c.err;
  const Outcome fmu = folder.whirl("export fmu c.json --out unit");
  EXPECT_EQ(fmu.exit_code, 0) << fmu.err;
}

TEST(LawFileE2e, WhatIsWrongIsOneErrorThatSaysWhere) {
  Folder folder;
  folder.write("plant.json", kPlantOfLaw);
  folder.write("law.json", R"({"schema": "whirl.law/1", "sample_time_s": 0.002, "x": {"D": [-1]}})");
  const auto refused = [&](const std::string& line, const std::string& part) {
    const Outcome out = folder.whirl(line);
    EXPECT_EQ(out.exit_code, 2);
    EXPECT_NE(out.err.find(part), std::string::npos) << out.err;
  };
  refused("design plant.json --law-file law.json", "law.json: $.sample_time_s: 0.002 s: must be that of the loop");
  refused("design plant.json --law-file law.json --law pd", "--law");
  refused("design plant.json --law state_space", "--law-file");
  folder.write("law.json", R"({"schema": "whirl.law/1", "x": {"num": [1, 0], "den": [1]}})");
  refused("design plant.json --law-file law.json", "$.x.num: degree 1 above that of den");
}

// The loop may hold although the law does not; the name stands in the result.
TEST(LawFileE2e, AnUnstableLawIsNamed) {
  Folder folder;
  folder.write("plant.json", kPlantOfLaw);
  folder.write("law.json", R"({"schema": "whirl.law/1", "x": {"num": [-100, -2000], "den": [1, -1]}})");
  const Outcome out = folder.whirl("design plant.json --law-file law.json --evaluations 1 --out c.json");
  EXPECT_EQ(out.exit_code, 1);
  EXPECT_NE((out.out + out.err).find("unstable by itself"), std::string::npos) << out.out << out.err;
}

}  // namespace
}  // namespace whirl::testing
