#include <gtest/gtest.h>

#include <complex>

#include "loop/served.hpp"
#include "made_files.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"

namespace whirl::testing {
namespace {

constexpr const char* kTilt =
    "[tilt]\npolar_kgm2 = 6e-3\ndiametral_kgm2 = 3.2e-3\nstiffness_Nm = 383\ncoupling_N = -1026\n";

TEST(RigE2e, CampbellPrintsTheWhirlFrequenciesOfARotorThatTilts) {
  const Folder folder;
  folder.write("rig.toml", kTilt);
  const Outcome outcome =
      folder.whirl("rig campbell --rig rig.toml --points 5 --out campbell.csv --figure campbell.svg");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("critical speeds"), std::string::npos);
  const io::Table table = io::read_table(folder / "campbell.csv");
  ASSERT_EQ(table.rows(), 5);
  EXPECT_NEAR(table["forward_tilt"][0], table["backward_tilt"][0], 1e-6);  // no gyroscopic moment at rest
  EXPECT_GT(table["forward_tilt"][4], 1.5 * table["backward_tilt"][4]);
  EXPECT_GT(table["forward"][4], table["backward"][4]);
  const std::string diagram = slurp(folder / "campbell.svg");
  for (const char* part : {">backward, tilt</text>", ">forward</text>", ">1X</text>",
                           "critical speed of the unbalance: ", "rotor speed [rpm]", ">rig.toml</text>"})
    EXPECT_NE(diagram.find(part), std::string::npos) << part;

  const Outcome record = folder.whirl("rig record --rig rig.toml --out run.csv");
  EXPECT_EQ(record.exit_code, 0) << record.err;
  EXPECT_EQ(io::read_table(folder / "run.csv").rows(), 14000);
}

TEST(RigE2e, CampbellOfARotorWithoutTiltIsRefused) {
  const Folder folder;
  folder.write("rig.toml", "[rotor]\nmass_kg = 1.5\n");
  const Outcome outcome = folder.whirl("rig campbell --rig rig.toml");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("tilt.diametral"), std::string::npos) << outcome.err;
}

// The rows leave the first half second out; what happened there is told beside them. A rotor that does not move has no
// suppression.
TEST(RunE2e, TheLargestMotionOfAllIsToldBesideTheRowsAndNothingIsNaN) {
  const Folder folder;
  io::save(folder / "controller.json", pd_design());
  const std::string profile = "[profile]\nstart_rpm = 600\nramp_s = 1\ndwell_end_s = 0.5\n";
  folder.write("rig.toml", profile + "[rotor]\nadded_mass_g = 5\n");
  Outcome o = folder.whirl("run controller.json --rig rig.toml");
  EXPECT_NE(o.out.find("The first 0.5 s count in no row; with them the disk centre was "), std::string::npos) << o.out;
  const std::string still = "[modes.1]\ninitial_um = 0\n[modes.2]\ninitial_um = 0\n[modes.3]\ninitial_um = 0\n";
  folder.write("still.toml", profile + "[rotor]\nadded_mass_g = 0\nresidual_eccentricity_um = 0\n" + still);
  o = folder.whirl("run controller.json --rig still.toml");
  EXPECT_NE(o.out.find("5 whole run"), std::string::npos) << o.out << o.err;
  EXPECT_EQ(o.out.find("nan"), std::string::npos) << o.out;
  o = folder.whirl("run controller.json --rig still.toml --json --quiet");
  const io::Json whole = *io::parse_json(o.out, "run").find("whole");
  EXPECT_EQ(*whole.find("open_peak")->get<double>(), 0);
  EXPECT_FALSE(whole.find("suppression")->get<double>());
}

// Turned at a twentieth of its critical speed the shaft shows its surface: 12 um at 1x by the rig's parameters.
// Without --rig a run is on the rig of the paper, which tells of no other machine.
TEST(RunE2e, ARigThatNobodyChoseIsNoProofForAnotherMachine) {
  const Folder folder;
  ControllerDesign design = pd_design();
  io::save(folder / "own.json", design);
  design.model.k1 *= 2.25;
  io::save(folder / "other.json", design);
  ASSERT_EQ(folder.whirl("rig parameters > rig.toml").exit_code, 0);
  const auto says = [&](const std::string& call) {
    const Outcome run = folder.whirl("run " + call + " --quiet");
    return std::pair(run.exit_code, run.err.find("says nothing of the controller's machine") != std::string::npos);
  };
  EXPECT_FALSE(says("own.json").second);
  EXPECT_EQ(says("other.json"), std::pair(1, true));
  EXPECT_FALSE(says("other.json --rig rig.toml").second);
}

TEST(DesignE2e, ASlowRollGivesTheRunoutToRemove) {
  const Folder folder;
  folder.write("slow.toml", "[profile]\nstart_rpm = 33.4\nend_rpm = 23.9\nramp_s = 9\ndwell_end_s = 0\n");
  ASSERT_EQ(folder.whirl("rig record --rig slow.toml --out slow.csv").exit_code, 0);
  copy_model(folder);
  const std::string design = "design model.json --mass-kg 1.5 --law pd --estimator kfe --evaluations 10 --quiet ";
  const Outcome outcome = folder.whirl(design + "--slow-roll slow.csv --out controller.json");
  EXPECT_NE(outcome.exit_code, 2) << outcome.err;
  const io::Json controller = io::load_json(folder / "controller.json");
  const auto parameter = [&](const char* name) { return *controller.find("parameters")->find(name)->get<double>(); };
  EXPECT_NEAR(std::hypot(parameter("runout_x_cos_1"), parameter("runout_x_sin_1")), 12e-6, 1e-6);
  EXPECT_NE(slurp(folder / "controller.json").find("slow.csv sha256:"), std::string::npos);
  const Outcome still = folder.whirl(design + "--slow-roll model.json --out c.json");
  EXPECT_EQ(still.exit_code, 2);
  EXPECT_NE(still.err.find("model.json"), std::string::npos) << still.err;
}

// The advice of the record taken: the correction mass balances the rig to the grade asked for.
TEST(BalanceE2e, MassAndAngleCancelTheUnbalance) {
  const Folder folder;
  copy_model(folder);
  const Outcome outcome = folder.whirl("balance model.json --mass-kg 1.5 --radius-mm 82.73 --speed-rpm 1797 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const io::Json advice = io::parse_json(outcome.out, "stdout");
  const auto number = [&](const char* key) { return *advice.find(key)->get<double>(); };
  EXPECT_NEAR(number("grade_mm_s"), 0.3199 * 188.2, 0.03 * 60);
  // 5 g at angle 0 and the residual 51.3 um at 0.6 rad (kg m): what is left after the correction.
  const std::complex<double> unbalance = 5e-3 * 82.73e-3 + 1.5 * std::polar(51.3e-6, 0.6);
  const std::complex<double> added =
      number("correction_mass_kg") * 82.73e-3 * std::polar(1.0, number("correction_angle_rad"));
  EXPECT_LT(std::abs(unbalance + added), 0.1 * std::abs(unbalance));
  EXPECT_EQ(folder.whirl("balance model.json --radius-mm 83 --speed-rpm 1800").exit_code, 2);  // no mass
}

}  // namespace
}  // namespace whirl::testing
