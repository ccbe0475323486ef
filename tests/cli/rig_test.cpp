#include <gtest/gtest.h>

#include "program.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::testing {
namespace {

constexpr const char* kTilt = "[tilt]\npolar_kgm2 = 6e-3\ndiametral_kgm2 = 3.2e-3\nstiffness_Nm = 383\ncoupling_N = -1026\n";

TEST(RigE2e, CampbellPrintsTheWhirlFrequenciesOfARotorThatTilts) {
  const Folder folder;
  folder.write("rig.toml", kTilt);
  const Outcome outcome = folder.whirl("rig campbell --rig rig.toml --points 5 --out campbell.csv");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("critical speeds"), std::string::npos);
  const Table table = read_table(folder / "campbell.csv");
  ASSERT_EQ(table.rows(), 5);
  EXPECT_NEAR(table["forward_tilt"][0], table["backward_tilt"][0], 1e-6);  // no gyroscopic moment at rest
  EXPECT_GT(table["forward_tilt"][4], 1.5 * table["backward_tilt"][4]);
  EXPECT_GT(table["forward"][4], table["backward"][4]);

  const Outcome record = folder.whirl("rig record --rig rig.toml --out run.csv");
  EXPECT_EQ(record.exit_code, 0) << record.err;
  EXPECT_EQ(read_table(folder / "run.csv").rows(), 14000);
}

TEST(RigE2e, CampbellOfARotorWithoutTiltIsRefused) {
  const Folder folder;
  folder.write("rig.toml", "[rotor]\nmass_kg = 1.5\n");
  const Outcome outcome = folder.whirl("rig campbell --rig rig.toml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("tilt.diametral"), std::string::npos) << outcome.err;
}

TEST(PredictiveE2e, DesignedFromARecordRunsOnTheRigAndIsNotExported) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 5 --out down.csv").exit_code, 0);
  ASSERT_EQ(folder.whirl("identify down.csv --out model.json --quiet").exit_code, 0);
  const Outcome design =
      folder.whirl("design model.json --mass-kg 1.5 --law mpc --estimator kfe --evaluations 2 --out mpc.json --quiet");
  ASSERT_EQ(design.exit_code, 0) << design.err;
  const Outcome run = folder.whirl("run mpc.json --added-mass-g 5");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Outcome exported = folder.whirl("export c mpc.json --out code");
  EXPECT_EQ(exported.exit_code, 2);
  EXPECT_NE(exported.err.find("design lqr instead"), std::string::npos) << exported.err;
}

}  // namespace
}  // namespace whirl::testing
