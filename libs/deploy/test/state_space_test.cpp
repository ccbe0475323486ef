// A law of the user in the exported C and as an FMU: the forces of the library.
#include "whirl/control/laws/state_space.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fmu_fixture.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/control/step_wrapper.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

control::LinearAxis drawn(std::mt19937_64& random, int order) {
  std::uniform_real_distribution<double> any(-1, 1);
  control::LinearAxis out;
  out.order = order;
  const auto n = static_cast<std::size_t>(order);
  for (std::size_t i = 0; i < n; ++i) {
    // Every third entry is zero and left out of the C.
    for (std::size_t j = 0; j < n; ++j) out.a[i * 12 + j] = (i + j) % 3 == 2 ? 0 : 1.2 * any(random) / order;
    for (std::size_t k = 0; k < 4; ++k) out.b[i * 4 + k] = any(random);
    out.c[i] = 300 * any(random);
  }
  out.d = {-1000, 100 * any(random), -60, 0};
  return out;
}

ControllerDesign drawn_design(int order_x, int order_y, bool supervised) {
  std::mt19937_64 random(static_cast<std::uint64_t>(order_x + 100 * order_y));
  ControllerDesign d = testing::design_of("state_space", "kfe");
  for (const auto& [name, value] :
       control::linear_parameters(drawn(random, order_x), drawn(random, order_y), d.model.gain, d.sample_time))
    d.parameters[name] = value;
  d.parameters["supervise"] = supervised ? 1 : 0;
  return d;
}

constexpr std::pair<int, int> kOrders[] = {{0, 0}, {1, 0}, {0, 3}, {12, 12}};

TEST(StateSpaceExport, TheExportedStepGivesTheForcesOfTheLibrary) {
  for (const auto& [x, y] : kOrders) {
    const ControllerDesign d = drawn_design(x, y, true);
    const testing::TemporaryFolder folder;
    const ControllerCode code = controller_code(d, {"drive", false, ""});
    folder.write(code.header.name, code.header.text);
    folder.write(code.source.name, code.source.text);
    folder.write("wrapper.c", testing::step_wrapper());
    const auto built = testing::shell(
        folder.path(), "cc " + std::string(testing::kStrictC99) + " -fPIC -shared drive.c wrapper.c -lm -o drive.so");
    ASSERT_EQ(built.exit_code, 0) << built.text;
    const testing::SharedLibrary library(folder.path() / "drive.so");
    ASSERT_EQ(library.get<int()>("start")(), 0);
    auto* go = library.get<int(const double*, int, double*)>("go");
    control::Controller mine = control::make_controller(d);
    double worst = 0, largest = 0;
    for (const Measurement& m : testing::run_down_readings()) {
      const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
      double out[3] = {};
      const int status = go(in, 1, out);
      const auto u = mine.step(m);
      ASSERT_EQ(status == 0, static_cast<bool>(u));
      if (!u) break;
      worst = std::max({worst, std::abs(out[0] - u->ux), std::abs(out[1] - u->uy)});
      largest = std::max(largest, std::abs(u->ux));
      ASSERT_EQ(static_cast<std::uint32_t>(out[2]), mine.state().supervision.word);
    }
    EXPECT_GT(largest, 1) << x << " " << y;
    EXPECT_LT(worst, 1e-12 * largest) << x << " " << y;
  }
}

TEST(StateSpaceExport, FloatCompilesAndChecksItself) {
  for (const auto& [x, y] : kOrders) {
    const testing::TemporaryFolder folder;
    for (const SourceFile& f : export_c99(drawn_design(x, y, false), {"drive", true, ""}, 200))
      folder.write(f.name, f.text);
    const auto made = testing::shell(folder.path(), "make check CFLAGS='" + std::string(testing::kStrictC99) + "'");
    EXPECT_EQ(made.exit_code, 0) << made.text;
  }
}

using StateSpaceFmuExport = FmuExport;
INSTANTIATE_TEST_SUITE_P(Versions, StateSpaceFmuExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

TEST_P(StateSpaceFmuExport, TheFmuGivesTheForcesOfTheLibrary) {
  const ControllerDesign d = drawn_design(12, 3, true);
  const Importer fmu = import(d);
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_NE(c, nullptr);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  control::Controller mine = control::make_controller(d);
  double worst = 0, largest = 0;
  for (const Measurement& m : testing::run_down_readings()) {
    const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
    const char* names[] = {"x", "y", "beta", "omega", "omega_dot"};
    for (int i = 0; i < 5; ++i) ASSERT_EQ(fmu.set(c, names[i], in[i]), 0);
    ASSERT_EQ(fmu.step(c, m.t, 1e-3), 0);
    const auto u = mine.step(m);
    if (!u) break;  // the supervision's last step
    worst = std::max({worst, std::abs(fmu.get(c, "ux") - u->ux), std::abs(fmu.get(c, "uy") - u->uy)});
    largest = std::max(largest, std::abs(u->ux));
  }
  EXPECT_GT(largest, 1);
  EXPECT_LE(worst, 1e-12 * largest);
  fmu.free(c);
}

}  // namespace
}  // namespace whirl::deploy
