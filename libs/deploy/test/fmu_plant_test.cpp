#include "whirl/deploy/fmu_plant.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

IdentifiedModel profiled_rotor() {
  IdentifiedModel m;
  m.rotor = testing::design_of("pd", "lpf").model;
  return m;
}

std::filesystem::path packed(const testing::TemporaryFolder& folder, int version, bool co_simulation = true) {
  FmuOptions options;
  options.version = version;
  options.code.prefix = "rotor";
  options.co_simulation = co_simulation;
  const auto path = folder.path() / "rotor.fmu";
  pack_fmu(fmu_files(profiled_rotor(), options), options, path);
  return path;
}

/// Largest displacement after the start, m.
template <class Control>
double peak(FmuPlant& plant, const Control& control) {
  double largest = 0;
  for (long k = 0; k < plant.ticks(); ++k) {
    const Measurement m = plant.read();
    if (m.t > 0.5) largest = std::max(largest, std::hypot(m.x, m.y));
    plant.write(control(m));
    plant.advance();
  }
  EXPECT_FALSE(plant.failed());
  return largest;
}

TEST(FmuPlantExport, UncontrolledRunEqualsTheSimulationAndAControllerSuppressesIt) {
  const testing::TemporaryFolder folder;
  for (const int version : {2, 3}) {
    const auto path = packed(folder, version);
    const FmuPlantOptions options{rotor::SpeedProfile::run_down(188.5, 6), 1e-3, {}};
    FmuPlant open(path, options);
    EXPECT_EQ(open.version(), version);
    const double free_peak = peak(open, [](const Measurement&) { return Command{}; });
    const rotor::Response reference =
        rotor::simulate(*profiled_rotor().rotor, rotor::angle_signal(options.profile, 1e-3), {0, 0}, {0, 0});
    EXPECT_NEAR(free_peak, reference.z.tail(reference.z.size() - 501).cwiseAbs().maxCoeff(), 1e-6 * free_peak);
    ControllerDesign design = testing::design_of("tsmc", "kfe");
    design.delay = 0;
    design.parameters["sensor_delay"] = 0;
    control::Controller controller = control::make_controller(design);
    FmuPlant closed(path, options);
    const double held_peak = peak(closed, [&](const Measurement& m) {
      const auto u = controller.step(m);
      return u ? *u : Command{};
    });
    EXPECT_LT(held_peak, 0.1 * free_peak);
  }
}

TEST(FmuPlantExport, WrongFilesAndNamesAreRefused) {
  const testing::TemporaryFolder folder;
  FmuPlantOptions options{rotor::SpeedProfile::run_down(188.5, 6), 1e-3, {}};
  EXPECT_THROW(FmuPlant(folder.path() / "none.fmu", options), Error);
  folder.write("text.fmu", "no ZIP file");
  EXPECT_THROW(FmuPlant(folder.path() / "text.fmu", options), Error);
  const auto path = packed(folder, 2);
  options.names = {{"x", "no.such"}};
  EXPECT_THROW(FmuPlant(path, options), Error);
  options.names = {{"z", "x"}};
  EXPECT_THROW(FmuPlant(path, options), Error);
  options.names = {{"x", "vx"}};
  EXPECT_NO_THROW(FmuPlant(path, options));
  EXPECT_THROW(FmuPlant(packed(folder, 2, false), {options.profile, 1e-3, {}}), Error) << "no co-simulation";
}

TEST(FmuPlantExport, ARefusedStepIsLatched) {
  const testing::TemporaryFolder folder;
  FmuPlant plant(packed(folder, 3), {rotor::SpeedProfile::run_down(188.5, 6), 1e-3, {}});
  plant.advance();
  EXPECT_TRUE(plant.read().valid);
  plant.write({NAN, 0});
  plant.advance();
  EXPECT_TRUE(plant.failed());
  EXPECT_FALSE(plant.read().valid);
  plant.write({});
  plant.advance();
  EXPECT_TRUE(plant.failed());
}

}  // namespace
}  // namespace whirl::deploy
