// The exported predictive law beside the library's: its quadratic program on problems far from any rotor, so that every
// way through the search for the active set is taken, and as an FMU at the force limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include "importer.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

constexpr int kLength = control::BoundedRegulator::kMaxHorizon;

// `plant` is a00, a01, a10, a11, b0, b1, kp, kd. Returns 0 without an answer.
constexpr const char* kWrapper = R"(#include "drive.c"
int solve_program(const double *plant, int n, double x, double v, const double *low, const double *high, double *w) {
  drive_axis axis; drive_program q; int k, solved;
  axis.a00 = plant[0]; axis.a01 = plant[1]; axis.a10 = plant[2]; axis.a11 = plant[3];
  axis.b0 = plant[4]; axis.b1 = plant[5]; axis.kp = plant[6]; axis.kd = plant[7];
  drive_free_inputs(&axis);
  for (k = 0; k < n; k++) { q.low[k] = low[k]; q.high[k] = high[k]; }
  solved = drive_solve(&axis, n, x, v, &q);
  for (k = 0; k < n; k++) w[k] = q.w[k];
  return solved;
}
)";

TEST(PredictiveExport, QuadraticProgramEqualsTheLibrary) {
  const testing::TemporaryFolder folder;
  const ControllerCode code = controller_code(testing::design_of("mpc", "lpf"), {"drive", false, ""});
  folder.write(code.header.name, code.header.text);
  folder.write(code.source.name, code.source.text);
  folder.write("wrapper.c", kWrapper);
  const auto built =
      testing::shell(folder.path(), "cc " + std::string(testing::kStrictC99) + " -fPIC -shared -o w.so wrapper.c -lm");
  ASSERT_EQ(built.exit_code, 0) << built.text;
  const testing::SharedLibrary library(folder.path() / "w.so");
  const auto solve =
      library.get<int(const double*, int, double, double, const double*, const double*, double*)>("solve_program");

  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  int most = 0, limited = 0;
  double worst = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    // A stable plant and a gain small enough to leave it so.
    const double radius = 0.99 * std::sqrt(std::abs(u(random))), angle = 3 * u(random), b = u(random);
    const control::SampledAxis plant{radius * std::cos(angle),
                                     radius * std::sin(angle),
                                     -radius * std::sin(angle),
                                     radius * std::cos(angle),
                                     u(random),
                                     b};
    const double kp = u(random), kd = u(random);
    const double x = 3 * u(random), v = 3 * u(random), width = std::exp(2 * u(random)),
                 amplitude = 2 * width * u(random), turn = u(random);
    control::BoundedRegulator::Inputs low, high, w;
    for (int k = 0; k < kLength; ++k) {
      low[static_cast<std::size_t>(k)] = amplitude * std::cos(turn * k) - width;
      high[static_cast<std::size_t>(k)] = amplitude * std::cos(turn * k) + width;
    }
    const int n = 1 + trial % kLength;
    control::BoundedRegulator::Bounds set{};
    const auto expected = control::BoundedRegulator(plant, kp, kd, n).solve(x, v, low, high, set);
    const double numbers[] = {plant.a00, plant.a01, plant.a10, plant.a11, plant.b0, plant.b1, kp, kd};
    const bool solved = solve(numbers, n, x, v, low.data(), high.data(), w.data()) != 0;
    ASSERT_EQ(solved, expected.solved) << trial;
    most = std::max(most, expected.iterations);
    double scale = 0, error = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(n); ++k) {
      scale = std::max(scale, std::abs(expected.w[k]));
      error = std::max(error, std::abs(w[k] - expected.w[k]));
      limited += set[k] != control::BoundedRegulator::Bound::none;
    }
    worst = std::max(worst, error / scale);
    EXPECT_LE(error, 1e-10 * scale) << trial;
  }
  RecordProperty("worst", std::to_string(worst));
  std::printf("largest difference %.2g of the largest input, %d sets tried at most\n", worst, most);
  EXPECT_GT(most, 20);  // exchanges one at a time
  EXPECT_GT(limited, 5000);
}

TEST(PredictiveExport, FmuAtTheForceLimitEqualsTheLibraryStepByStep) {
  ControllerDesign design = testing::design_of("mpc", "kfe");
  design.force_limit = 5;
  for (const int version : {2, 3}) {
    const testing::TemporaryFolder folder;
    FmuOptions options;
    options.version = version;
    options.code.prefix = "unit";
    const testing::Importer fmu = testing::packed(folder, fmu_files(design, options), options);
    void* const c = fmu.instantiate(false, fmu.token);
    ASSERT_NE(c, nullptr);
    ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
    ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
    control::Controller controller = control::make_controller(design);
    int at_limit = 0;
    double error = 0;
    for (const Measurement& m : testing::run_down_readings(1e-3)) {
      const std::pair<const char*, double> in[] = {
          {"x", m.x}, {"y", m.y}, {"beta", m.beta}, {"omega", m.omega}, {"omega_dot", m.omega_dot}};
      for (const auto& [name, value] : in) ASSERT_EQ(fmu.set(c, name, value), 0);
      fmu.set_boolean(c, "valid", true);
      ASSERT_EQ(fmu.step(c, m.t, 1e-3), 0);
      const auto out = controller.step(m);
      ASSERT_TRUE(out);
      error = std::max({error, std::abs(fmu.get(c, "ux") - out->ux), std::abs(fmu.get(c, "uy") - out->uy)});
      ASSERT_EQ(fmu.get_boolean(c, "saturated"), controller.state().saturated);
      at_limit += controller.state().saturated;
    }
    EXPECT_LE(error, 1e-12 * design.force_limit) << version;
    EXPECT_GT(at_limit, 5000);
    fmu.free(c);
  }
}

}  // namespace
}  // namespace whirl::deploy
