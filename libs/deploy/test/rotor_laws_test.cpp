// Laws whose gains follow the speed, multi-channel adaptation and H-infinity in the exported C and as an FMU: the
// forces of the library, for axes that differ and for both directions of turning.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fmu_fixture.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/control/step_wrapper.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

ControllerDesign rotor_design(const std::string& law, bool predicted, bool supervised) {
  ControllerDesign d = testing::design_of(law, predicted ? "kfe" : "lpf");
  d.model.k1_conj = {300, -80}, d.model.c_conj = {0.1, 0.05};
  d.parameters["predict"] = predicted ? 1 : 0;
  d.parameters["supervise"] = supervised ? 1 : 0;
  if (law == "pd_scheduled") {
    for (int k = 1; k <= 4; ++k) {
      d.parameters[fmt::format("kp_{}", k)] = 500.0 * k * k - 2000;
      d.parameters[fmt::format("kd_{}", k)] = 120 - 20.0 * k;
    }
  }
  return d;
}

constexpr const char* kRotorLaws[] = {"lqi", "hinf", "pd_scheduled", "pd_fxlms_xy"};

TEST(RotorLawsExport, TheExportedStepGivesTheForcesOfTheLibrary) {
  for (const char* law : kRotorLaws) {
    for (const bool predicted : {false, true}) {
      const ControllerDesign d = rotor_design(law, predicted, true);
      const testing::TemporaryFolder folder;
      const ControllerCode code = controller_code(d, {"drive", false, ""});
      folder.write(code.header.name, code.header.text);
      folder.write(code.source.name, code.source.text);
      folder.write("wrapper.c", testing::step_wrapper());
      const auto built = testing::shell(
          folder.path(), "cc " + std::string(testing::kStrictC99) + " -fPIC -shared drive.c wrapper.c -lm -o drive.so");
      ASSERT_EQ(built.exit_code, 0) << built.text;
      const testing::SharedLibrary library(folder.path() / "drive.so");
      auto* go = library.get<int(const double*, int, double*)>("go");
      for (const double side : {1.0, -1.0}) {
        ASSERT_EQ(library.get<int()>("start")(), 0);
        control::Controller mine = control::make_controller(d);
        double worst = 0, largest = 0;
        for (Measurement m : testing::run_down_readings()) {
          m.y *= side, m.beta *= side, m.omega *= side, m.omega_dot *= side;
          const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
          double out[3] = {};
          const int status = go(in, 1, out);
          const auto u = mine.step(m);
          ASSERT_EQ(status == 0, static_cast<bool>(u));
          if (!u) break;
          worst = std::max({worst, std::abs(out[0] - u->ux), std::abs(out[1] - u->uy)});
          largest = std::max(largest, std::abs(u->ux));
        }
        EXPECT_GT(largest, 0.1) << law << " " << predicted;
        EXPECT_LT(worst, 1e-12 * largest) << law << " " << predicted << " " << side;
      }
    }
  }
}

TEST(RotorLawsExport, FloatCompilesAndChecksItself) {
  for (const char* law : kRotorLaws) {
    const testing::TemporaryFolder folder;
    for (const SourceFile& f : export_c99(rotor_design(law, true, false), {"drive", true, ""}, 200))
      folder.write(f.name, f.text);
    const auto made = testing::shell(folder.path(), "make check CFLAGS='" + std::string(testing::kStrictC99) + "'");
    EXPECT_EQ(made.exit_code, 0) << law << made.text;
  }
}

using RotorLawsFmuExport = FmuExport;
INSTANTIATE_TEST_SUITE_P(Versions, RotorLawsFmuExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

TEST_P(RotorLawsFmuExport, TheFmuGivesTheForcesOfTheLibrary) {
  for (const char* law : kRotorLaws) {
    const ControllerDesign d = rotor_design(law, true, false);
    const Importer fmu = import(d);
    void* const c = fmu.instantiate(false, fmu.token);
    ASSERT_NE(c, nullptr);
    ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
    ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
    control::Controller mine = control::make_controller(d);
    double worst = 0, largest = 0;
    std::vector<Measurement> readings = testing::run_down_readings();
    readings.resize(4000);
    for (const Measurement& m : readings) {
      const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
      const char* names[] = {"x", "y", "beta", "omega", "omega_dot"};
      for (int i = 0; i < 5; ++i) ASSERT_EQ(fmu.set(c, names[i], in[i]), 0);
      ASSERT_EQ(fmu.step(c, m.t, 1e-3), 0);
      const auto u = mine.step(m);
      ASSERT_TRUE(u);
      worst = std::max({worst, std::abs(fmu.get(c, "ux") - u->ux), std::abs(fmu.get(c, "uy") - u->uy)});
      largest = std::max(largest, std::abs(u->ux));
    }
    EXPECT_GT(largest, 0.1) << law;
    EXPECT_LE(worst, 1e-12 * largest) << law;
    fmu.free(c);
  }
}

}  // namespace
}  // namespace whirl::deploy
