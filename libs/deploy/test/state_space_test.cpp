// A law of the user in the exported C and as an FMU: the forces of the library.
#include "whirl/control/laws/state_space.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fmu_fixture.hpp"
#include "step_difference.hpp"

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
    SCOPED_TRACE(fmt::format("orders {} {}", x, y));
    StepDifference found;
    compare_code(drawn_design(x, y, true), 1, found);
    EXPECT_GT(found.largest, 1);
    EXPECT_LT(found.worst, 1e-12 * found.largest);
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
  StepDifference found;
  compare_fmu(import(d), d, testing::run_down_readings(), found);
  EXPECT_GT(found.largest, 1);
  EXPECT_LE(found.worst, 1e-12 * found.largest);
}

}  // namespace
}  // namespace whirl::deploy
