#include <gtest/gtest.h>

#include "program.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

// A rotor of 1.5 kg at 12 Hz and a mode at 46 Hz against the sensor, as another program would write it.
constexpr const char* kPlant = R"({"schema": "whirl.plant/1",
  "A": [[0, 1, 0, 0], [-5685, -1.5, 0, 0], [0, 0, 0, 1], [0, 0, -83540, -4.6]],
  "B": [[0], [0.6667], [0], [-0.02]],
  "C": [[1, 0, 1, 0]],
  "eccentricity_m": 3e-4})";

/// The rotor of the plant file as a model, with a cubic spring.
IdentifiedModel rotor_of_fmu() {
  IdentifiedModel m;
  m.method = "stand-in";
  m.rotor.emplace();
  m.rotor->k1 = 5685, m.rotor->k2 = 1e8, m.rotor->c = 1.5;
  m.rotor->eps = 3e-4;
  return m;
}

TEST(PlantFileE2e, DesignMarginsRobustnessAndCompareTakeAPlantOfAnotherProgram) {
  Folder folder;
  folder.write("plant.json", kPlant);
  ASSERT_EQ(folder.whirl("design plant.json --law pd --estimator kfe --evaluations 12 --out c.json --quiet").exit_code,
            0)
      << slurp(folder / "stderr.txt");
  EXPECT_EQ(folder.whirl("margins c.json plant.json --speeds 3 --quiet").exit_code, 0);
  const Outcome study = folder.whirl("robustness c.json plant.json --samples 16 --limit-mm 0.1 --quiet --out study");
  EXPECT_EQ(study.exit_code, 0) << study.err;
  const io::Json json = io::parse_json(slurp(folder / "study/robustness.json"), "robustness.json");
  const io::JsonReader in(json, "robustness.json");
  EXPECT_EQ(in.at("stable").at("count").integer(), 16);
  EXPECT_LT(in.at("peak_median").number(), 0.1e-3);
  const Outcome compared =
      folder.whirl("compare plant.json --laws pd:kfe --evaluations 4 --seeds 1 --no-matrix --quiet --out all");
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_NE(slurp(folder / "all/comparison.json").find("\"pd, kfe\""), std::string::npos);
}

TEST(PlantFileE2e, AWrongPlantGivesOneErrorThatSaysWhere) {
  Folder folder;
  std::string text = kPlant;
  folder.write("unstable.json", text.replace(text.find("-1.5"), 4, "1.5"));
  const Outcome out = folder.whirl("design unstable.json --law pd --out c.json");
  EXPECT_EQ(out.exit_code, 2);
  EXPECT_NE(out.err.find("unstable.json"), std::string::npos) << out.err;
  EXPECT_NE(out.err.find("not stable"), std::string::npos) << out.err;
  folder.write("plant.json", kPlant);
  EXPECT_NE(folder.whirl("design plant.json --mass-kg 1.5 --law pd").err.find("leave --stiffness, --mass-kg"),
            std::string::npos);
}

// A plant that only answers: whirl runs, pulls and hits the FMU itself, and closes the loop on it in the end.
TEST(PlantFileE2e, DesignAndRobustnessTakeAnFmu) {
  Folder folder;
  io::save(folder / "model.json", rotor_of_fmu());
  ASSERT_EQ(folder.whirl("export fmu model.json --mass-kg 1.5 --out . --prefix plant --quiet").exit_code, 0);
  const Outcome designed =
      folder.whirl("design plant.fmu --law pd --estimator kfe --evaluations 12 --out c.json --quiet");
  EXPECT_EQ(designed.exit_code, 0) << designed.err;
  double open = 0, closed = 0;
  const std::size_t line = designed.out.find("on the FMU");
  ASSERT_NE(line, std::string::npos) << designed.out;
  ASSERT_EQ(
      std::sscanf(designed.out.c_str() + line,
                  "on the FMU, forces 2 samples late: peak radius %lf mm without control, %lf mm", &open, &closed),
      2);
  EXPECT_LT(closed, 0.05 * open);
  const Outcome study = folder.whirl("robustness c.json plant.fmu --samples 8 --limit-mm 0.1 --quiet --json");
  EXPECT_EQ(study.exit_code, 0) << study.err;
  EXPECT_NE(folder.whirl("design plant.fmu --mass-kg 1.5 --law pd").err.find("an FMU is pulled and hit by whirl"),
            std::string::npos);
  EXPECT_NE(folder.whirl("design plant.fmu --fmu-name x=no.such").err.find("no.such"), std::string::npos);
}

}  // namespace
}  // namespace whirl::testing
