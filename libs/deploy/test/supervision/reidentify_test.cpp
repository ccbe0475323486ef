#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "../fmu_fixture.hpp"
#include "../step_difference.hpp"
#include "supervised_design.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/testing/control/foreign_rig.hpp"

namespace whirl::deploy {
namespace {

testing::ForeignMachine machine() {
  testing::ForeignMachine m = testing::ForeignMachine::draw(8, 0.1);
  m.gain = 1;
  m.down = 5, m.still = 2;
  m.top = 1.6 * m.critical(), m.bottom = 0.9 * m.critical();
  m.force_limit *= 2;
  return m;
}

ControllerDesign design_for(const char* law, const char* estimator, int reidentify) {
  const testing::ForeignMachine m = machine();
  ControllerDesign d = supervised_design(m, law, estimator);
  d.model.k1_conj = {0.003 * d.model.k1, 0.001 * d.model.k1};
  d.parameters["reidentify"] = reidentify;
  if (d.law == "pd") d.parameters["kp"] = 0.1 * d.model.k1, d.parameters["kd"] = 0.3 * m.critical();
  if (d.estimator == "kalman") d.parameters["predict"] = 1, d.parameters["slew_limit"] = 4e3;
  return d;
}

/// What the library measures on a softer machine with a weaker force; a few readings are lost.
std::vector<Measurement> readings(const ControllerDesign& d) {
  testing::ForeignMachine changed = machine();
  changed.stiffness *= 0.85, changed.damping *= 0.6, changed.gain = 0.75;
  control::Controller controller = control::make_controller(d);
  testing::ForeignRig rig(changed, 3);
  std::vector<Measurement> out;
  for (; !rig.done(); rig.advance()) {
    out.push_back(rig.read());
    out.back().valid = out.size() % 1500 > 3;
    const auto u = controller.step(out.back());
    rig.write(u ? *u : Command{});
  }
  return out;
}

// Estimates, deviations, correction and force of the exported step are those of the library; it corrects all three.
TEST(ReidentifyExport, TheExportedStepFindsAndCorrectsWhatTheLibraryDoes) {
  for (const auto& [law, estimator, mode] :
       {std::tuple{"pd", "lpf", 2}, std::tuple{"lqr", "kalman", 2}, std::tuple{"pd", "kfe", 1}}) {
    const ControllerDesign d = design_for(law, estimator, mode);
    const Exported exported(d, R"(
double told(int i);
double told(int i) {
  const drive_reidentifier *r = &state.reid;
  return (i < 3) ? r->estimate[i] : (i < 6) ? r->sd[i - 3] : (i < 9) ? r->acting[i - 6] : (double)r->word;
}
)");
    ASSERT_NE(exported.go, nullptr);
    auto* told = exported.library->get<double(int)>("told");
    control::Controller mine = control::make_controller(d);
    StepDifference force;
    double off = 0;
    for (const Measurement& m : readings(d)) {
      const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
      double out[3];
      ASSERT_EQ(exported.go(in, m.valid ? 1 : 0, out), 0);
      const auto u = mine.step(m);
      ASSERT_TRUE(u);
      force.add(out[0], out[1], *u);
      const control::Reidentification& r = mine.state().reidentification;
      for (int i = 0; i < 3; ++i) {
        const auto k = static_cast<std::size_t>(i);
        off = std::max({off, std::abs(told(i) - r.estimate[k]), std::abs(told(i + 3) - r.sd[k]),
                        std::abs(told(i + 6) - r.acting[k])});
      }
      ASSERT_EQ(static_cast<std::uint32_t>(told(9)), r.word) << law << " " << m.t;
    }
    EXPECT_LT(force.worst, 1e-12 * force.largest) << law << " " << estimator;
    EXPECT_LT(off, 1e-11) << law << " " << estimator;
    const control::Reidentification& r = mine.state().reidentification;
    EXPECT_EQ(r.acting != control::MachineShares{}, mode == 2) << law << " " << estimator;
  }
}

class ReidentifyFmuExport : public FmuExport {};
INSTANTIATE_TEST_SUITE_P(Versions, ReidentifyFmuExport, ::testing::Values(2, 3),
                         [](const auto& i) { return "Fmi" + std::to_string(i.param); });

TEST_P(ReidentifyFmuExport, ReidentifiedForcesAreThoseOfTheLibrary) {
  const ControllerDesign d = design_for("pd", "lpf", 2);
  std::vector<Measurement> all = readings(d);
  std::erase_if(all, [](const Measurement& m) { return m.t > 4; });
  for (Measurement& m : all) m.valid = true;
  StepDifference found;
  compare_fmu(import(d), d, all, found);
  EXPECT_LT(found.worst, 1e-12 * found.largest);
}

TEST(ReidentifyExport, PythonReadsTheEstimatesBehindTheForce) {
  if (!testing::has_program("python3")) GTEST_SKIP() << "python3 is not installed";
  const ControllerDesign d = design_for("pd", "lpf", 2);
  const testing::TemporaryFolder folder;
  for (const SourceFile& f : export_python(d, {"drive", false, ""})) folder.write(f.name, f.text);
  control::Controller mine = control::make_controller(d);
  std::string script = "from drive import Controller\nc = Controller()\nfor m in (\n";
  const std::vector<Measurement> all = readings(d);
  for (std::size_t k = 0; k < 1200; ++k) {
    const Measurement& m = all[k];
    script += fmt::format("    ({:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {}),\n", m.x, m.y, m.beta, m.omega,
                          m.omega_dot, m.valid ? "True" : "False");
    mine.step(m);
  }
  const control::Reidentification& r = mine.state().reidentification;
  ASSERT_NE(r.estimate[2], 0);
  script += fmt::format(
      "):\n    o = c.step(*m)\nassert abs(o.differs[2] - {:.17g}) < 1e-11\nassert abs(o.differs_sd[0] - {:.17g}) < "
      "1e-11\nassert o.reidentified == {}\n",
      r.estimate[2], r.sd[0], r.word);
  folder.write("main.py", script);
  const auto run = testing::shell(folder.path(), "python3 main.py");
  EXPECT_EQ(run.exit_code, 0) << run.text;
}

TEST(ReidentifyExport, NothingOfItWithoutItAndNoneInFloat) {
  ControllerDesign d = design_for("pd", "lpf", 2);
  EXPECT_THROW(controller_code(d, {"drive", true, ""}), Error);
  d.parameters["reidentify"] = 0;
  const ControllerCode code = controller_code(d, {"drive", false, ""});
  EXPECT_EQ((code.source.text + code.header.text).find("reid"), std::string::npos);
}

}  // namespace
}  // namespace whirl::deploy
