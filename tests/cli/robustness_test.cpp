#include <gtest/gtest.h>

#include "made_files.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::testing {
namespace {

/// A folder with a model, a controller designed on it, and one study to compare others with.
class RobustnessE2e : public ::testing::Test {
 protected:
  void SetUp() override {
    copy_model(folder);
    ASSERT_EQ(
        folder.whirl("design model.json --mass-kg 1.5 --law pd --estimator kfe --evaluations 5 --out c.json --quiet")
            .exit_code,
        0);
    ASSERT_EQ(folder.whirl(study(40) + " --threads 1 --out one").exit_code, 0) << slurp(folder / "stderr.txt");
    one = slurp(folder / "one/robustness.json");
  }
  static std::string study(int samples) {
    return "robustness c.json model.json --mass-kg 1.5 --limit-mm 0.02 --quiet --samples " + std::to_string(samples);
  }
  int shell(const std::string& command) const {
    return std::system(
        ("cd '" + (folder / "").string() + "' && ( " + command + " ) >shell.txt 2>&1 </dev/null").c_str());
  }
  Folder folder;
  std::string one;
};

TEST_F(RobustnessE2e, SameBytesForAnyLanesThreadsAndProcesses) {
  ASSERT_FALSE(one.empty());
  ASSERT_EQ(folder.whirl(study(40) + " --threads 3 --lanes 8 --out two").exit_code, 0);
  EXPECT_EQ(slurp(folder / "two/robustness.json"), one);
  ASSERT_EQ(folder.whirl(study(40) + " --lanes 32 --out three").exit_code, 0);
  EXPECT_EQ(slurp(folder / "three/robustness.json"), one);

  // As root in a container and with more processes than cores, mpirun wants to be told. Open MPI unloads its modules
  // with memory of theirs still held: a sanitizer build does not look for leaks there.
  const std::string mpirun =
      "ASAN_OPTIONS=detect_leaks=0 OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe "
      "-n ";
  if (shell("mpirun --version") != 0) GTEST_SKIP() << "no mpirun here";
  for (const char* ranks : {"1", "2", "3"}) {
    const std::string out = std::string("mpi") + ranks;
    const int status =
        shell(mpirun + ranks + " '" + program() + "' " + study(40) + " --threads 1 --lanes 8 --out " + out);
    const std::string said = slurp(folder / "shell.txt");
    if (said.find("built without MPI") != std::string::npos) GTEST_SKIP() << said;
    ASSERT_EQ(status, 0) << said;
    EXPECT_NE(said.find(std::string("with ") + ranks + " process"), std::string::npos) << said;
    EXPECT_EQ(slurp(folder / (out + "/robustness.json")), one) << ranks;
  }
}

TEST_F(RobustnessE2e, KilledStudyGoesOnToTheSameBytes) {
  // Stopped as soon as some samples are on disk, so that it is not done before the other program looks, and killed.
  shell(std::string("'") + program() + "' " + study(40) +
        " --threads 1 --lanes 8 --checkpoint ck.txt --out killed & p=$!; "
        "for i in $(seq 2000); do [ -f ck.txt ] && [ $(wc -l < ck.txt) -gt 8 ] && break; sleep 0.01; done; kill -STOP "
        "$p; '" +
        program() + "' " + study(40) +
        " --checkpoint ck.txt 2>second.txt; echo $? >second_code.txt; kill -9 $p; wait $p");
  // Meanwhile nobody else writes it.
  EXPECT_EQ(slurp(folder / "second_code.txt"), "2\n");
  EXPECT_NE(slurp(folder / "second.txt").find("ck.txt: another program is writing it"), std::string::npos)
      << slurp(folder / "second.txt");
  EXPECT_FALSE(std::filesystem::exists(folder / "killed/robustness.json"));
  std::string held = slurp(folder / "ck.txt");
  const auto lines = std::count(held.begin(), held.end(), '\n');
  EXPECT_GT(lines, 8);
  EXPECT_LT(lines, 41);
  folder.write("ck.txt", held + "0x1.4p+3 0x1.6");  // a line cut short
  const Outcome resumed = folder.whirl(study(40) + " --checkpoint ck.txt --out resumed");
  ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_EQ(slurp(folder / "resumed/robustness.json"), one);
  held = slurp(folder / "ck.txt");
  EXPECT_EQ(std::count(held.begin(), held.end(), '\n'), 41);

  // A checkpoint of another study is refused, not mixed in.
  const Outcome other = folder.whirl(study(41) + " --checkpoint ck.txt");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("checkpoint of another study"), std::string::npos) << other.err;

  // One digit of a sample changed, in its value or in its checksum: told, not taken.
  for (const bool in_sum : {false, true}) {
    std::string changed = held;
    const std::size_t end = changed.rfind('\n', changed.size() - 2), sum = changed.rfind(' ');
    const std::size_t digit = in_sum ? sum + 3 : changed.find_first_of("123456789", changed.find(' ', end));
    changed[digit] = changed[digit] == '1' ? '2' : '1';
    folder.write("ck.txt", changed);
    const Outcome altered = folder.whirl(study(40) + " --checkpoint ck.txt --out altered");
    EXPECT_EQ(altered.exit_code, 2) << altered.out;
    EXPECT_NE(altered.err.find("does not fit its checksum"), std::string::npos) << altered.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "altered/robustness.json"));
  }
}

TEST_F(RobustnessE2e, ReportsProbabilityWithItsInterval) {
  const io::Json json = io::parse_json(one, "robustness.json");
  const io::Json& exceeds = *json.find("exceeds");
  const io::Json::Array& ci = *exceeds.find("ci95")->get<io::Json::Array>();
  EXPECT_LE(*ci[0].get<double>(), *exceeds.find("value")->get<double>());
  EXPECT_GE(*ci[1].get<double>(), *exceeds.find("value")->get<double>());
  EXPECT_EQ(json.find("samples")->find("peak")->get<io::Json::Array>()->size(), 40u);
  EXPECT_NE(slurp(folder / "one/report.html").find("<svg"), std::string::npos);
  EXPECT_EQ(folder.whirl("robustness c.json model.json").exit_code, 2);  // no mass
  // A design whose own margins are too small fails here and on the rig, whatever the machines do; how far the model is
  // from its record is said with a number.
  auto design = io::load<ControllerDesign>(folder / "c.json");
  design.margins["gain_margin"] = 1.05;
  io::save(folder / "low.json", design);
  const Outcome low = folder.whirl("robustness low.json model.json --mass-kg 1.5 --samples 8 --quiet");
  EXPECT_EQ(low.exit_code, 1);
  EXPECT_NE(low.err.find("gain margin 1.05: must be at least 1.33"), std::string::npos) << low.err;
  EXPECT_NE(low.out.find("% (rms) of its held-out motion unexplained"), std::string::npos) << low.out;
  // What `design` called unusable is so here too, whatever the machines do.
  design = io::load<ControllerDesign>(folder / "c.json");
  design.summary.add(
      {FindingCode::requirement_missed, Consequence::unusable, {}, "not certified: the supervision steps in"});
  io::save(folder / "bad.json", design);
  const Outcome bad = folder.whirl("robustness bad.json model.json --mass-kg 1.5 --samples 8 --quiet --json");
  EXPECT_EQ(bad.exit_code, 1) << bad.err;
  EXPECT_NE(bad.err.find("not certified: the supervision steps in"), std::string::npos) << bad.err;
  EXPECT_NE(bad.out.find("requirement_missed"), std::string::npos) << bad.out;
  const Outcome run = folder.whirl("run low.json --added-mass-g 5");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.out.find("FAILS: the margins of the design: gain margin 1.05"), std::string::npos) << run.out;
  EXPECT_EQ(folder.whirl(study(40) + " --lanes 7").exit_code, 2);
}

// Other machines of the make have unbalances of other angles: a feedforward that was told one angle misses theirs.
TEST_F(RobustnessE2e, OtherMachinesHaveAnotherAngleOfTheUnbalance) {
  const auto median = [&](const std::string& options) {
    EXPECT_NE(folder.whirl(study(40) + " --out apart --force " + options).exit_code, 2) << options;
    return *io::parse_json(slurp(folder / "apart/robustness.json"), "robustness.json")
                .find("peak_median")
                ->get<double>();
  };
  EXPECT_GT(median("--other-machines"), 3 * median(""));
}

// The paper's argument along a run: what it needs is printed and written, and the command fails where eq. 42 does not
// hold, with the code of the finding.
TEST_F(RobustnessE2e, ARunTellsWhetherTheSlidingBoundHolds) {
  auto design = io::load<ControllerDesign>(folder / "c.json");
  design.law = "tsmc";
  design.parameters = {{"switching_gain", 0.3}, {"boundary_layer", 0.01}};
  design.margins.clear();
  io::save(folder / "sliding.json", design);
  const Outcome low = folder.whirl("run sliding.json --added-mass-g 5 --sliding v.csv --sliding-figure v.svg --json");
  EXPECT_EQ(low.exit_code, 1) << low.out << low.err;
  EXPECT_NE(low.out.find("\"sliding_bound_missed\""), std::string::npos) << low.out;
  const Outcome read = folder.whirl("info v.csv");
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_NE(read.out.find("specific energy"), std::string::npos) << read.out;
  const io::Json told = io::parse_json(low.out, "run");
  const io::Json& sliding = *told.find("sliding");
  EXPECT_FALSE(*sliding.find("holds")->get<bool>());
  EXPECT_EQ(*sliding.find("switching_gain")->get<double>(), 0.3);
  EXPECT_GT(*sliding.find("largest_disturbance")->get<double>(), 0.3);
  EXPECT_NE(slurp(folder / "v.svg").find("switching gain, eq. 42"), std::string::npos);
  EXPECT_TRUE(slurp(folder / "v.csv").starts_with("t_s,s_x_m_s,s_y_m_s")) << slurp(folder / "v.csv").substr(0, 80);
  design.law = "pd";
  design.parameters = {};
  io::save(folder / "pd.json", design);
  EXPECT_EQ(folder.whirl("run sliding.json --added-mass-g 5 --sliding v.csv --quiet").exit_code, low.exit_code)
      << "over its own file";
  for (const char* other : {"--off-nominal", "--monitor"})
    for (const char* wanted : {"--sliding u.csv", "--sliding-figure u.svg"})
      EXPECT_EQ(folder.whirl(std::string("run sliding.json ") + other + " " + wanted).exit_code, 2) << other << wanted;
  EXPECT_EQ(folder.whirl("run sliding.json --off-nominal --log u.csv").exit_code, 2);
  const Outcome none = folder.whirl("run pd.json --sliding w.csv");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("has no switching gain"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace whirl::testing
