#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/control/step_wrapper.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

// Structural modes taken out of the readings: the exported step gives the forces of the library.
TEST(StructureExport, TheExportedStepTakesTheSameModesOut) {
  for (const auto& [law, estimator] :
       {std::pair{"pd", "lpf"}, std::pair{"lsmc", "kfe"}, std::pair{"pd_notch", "lpf"}}) {
    ControllerDesign d = testing::design_of(law, estimator);
    if (d.law.starts_with("pd_")) d.feedforward = false;
    d.parameters["mode_1_omega"] = 289;
    d.parameters["mode_1_damping"] = 0.008;
    d.parameters["mode_1_share"] = -0.3;
    d.parameters["mode_3_omega"] = 804;
    d.parameters["mode_3_damping"] = 0.006;
    d.parameters["mode_3_share"] = 0.02;
    const testing::TemporaryFolder folder;
    const ControllerCode code = controller_code(d, {"drive", false, ""});
    const auto parameters =
        std::ranges::count_if(code.parameters, [](const auto& p) { return p.name.starts_with("mode_"); });
    EXPECT_EQ(parameters, 9);  // up to the last mode that takes part
    folder.write(code.header.name, code.header.text);
    folder.write(code.source.name, code.source.text);
    folder.write("wrapper.c", testing::step_wrapper(false));
    const auto built = testing::shell(
        folder.path(), "cc " + std::string(testing::kStrictC99) + " -fPIC -shared drive.c wrapper.c -lm -o drive.so");
    ASSERT_EQ(built.exit_code, 0) << built.text;
    const testing::SharedLibrary library(folder.path() / "drive.so");
    ASSERT_EQ(library.get<int()>("start")(), 0);
    auto* go = library.get<int(const double*, int, double*)>("go");
    control::Controller mine = control::make_controller(d);
    double worst = 0, largest = 0, without = 0;
    ControllerDesign bare = d;
    std::erase_if(bare.parameters, [](const auto& p) { return p.first.starts_with("mode_"); });
    control::Controller blind = control::make_controller(bare);
    for (const Measurement& m : testing::run_down_readings()) {
      const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
      double out[3] = {};
      ASSERT_EQ(go(in, 1, out), 0);
      const auto u = mine.step(m), other = blind.step(m);
      ASSERT_TRUE(u && other);
      worst = std::max({worst, std::abs(out[0] - u->ux), std::abs(out[1] - u->uy)});
      largest = std::max(largest, std::abs(u->ux));
      without = std::max(without, std::abs(other->ux - u->ux));
    }
    EXPECT_LT(worst, 1e-12 * largest) << law;
    EXPECT_GT(without, 1e-3 * largest) << law;
  }
}

}  // namespace
}  // namespace whirl::deploy
