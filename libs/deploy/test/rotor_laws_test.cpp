// Laws whose gains follow the speed, multi-channel adaptation and H-infinity in the exported C and as an FMU: the
// forces of the library, for axes that differ and for both directions of turning.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "fmu_fixture.hpp"
#include "step_difference.hpp"

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
  for (const char* law : kRotorLaws)
    for (const bool predicted : {false, true})
      for (const double side : {1.0, -1.0}) {
        SCOPED_TRACE(fmt::format("{} {} {}", law, predicted, side));
        StepDifference found;
        compare_code(rotor_design(law, predicted, true), side, found);
        EXPECT_GT(found.largest, 0.1);
        EXPECT_LT(found.worst, 1e-12 * found.largest);
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
  std::vector<Measurement> readings = testing::run_down_readings();
  readings.resize(4000);
  for (const char* law : kRotorLaws) {
    SCOPED_TRACE(law);
    const ControllerDesign d = rotor_design(law, true, false);
    StepDifference found;
    compare_fmu(import(d), d, readings, found);
    EXPECT_GT(found.largest, 0.1);
    EXPECT_LE(found.worst, 1e-12 * found.largest);
  }
}

}  // namespace
}  // namespace whirl::deploy
