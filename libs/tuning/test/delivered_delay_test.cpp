// The further delay that a certificate states is that of what is delivered, with its supervision.
#include "whirl/tuning/delivered_delay.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "limited_designs.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/rig/virtual_rig.hpp"

namespace whirl::tuning {
namespace {

/// Whether a controller, stepped beside the rig, trips, steps back or leaves `bound`, m, with so many samples more from
/// a time on.
bool fails(const ControllerDesign& d, const std::shared_ptr<const rig::RigTables>& tables, int samples, double from,
           double bound) {
  control::Controller controller = control::make_controller(d);
  rig::ScriptedFault late{rig::RigFault::extra_delay, from, 1e9};
  late.delay_samples = samples;
  rig::VirtualRig rig(tables, {77, {late}});
  const rig::RigTruth truth(rig);
  for (; !rig.done(); rig.advance()) {
    const Measurement m = rig.read();
    const auto u = controller.step(m);
    if (!u || (controller.state().supervision.word & control::kUnheld) != 0) return true;
    if (m.t > 0.5 && std::abs(truth.z().real()) > bound) return true;
    rig.write(*u);
  }
  return false;
}

/// The smallest whole number of samples with which it fails.
int stepped(const ControllerDesign& d, const rig::RigParameters& plant) {
  const auto tables = rig::make_rig_tables(plant);
  for (int n = 1; n <= 16; ++n) {
    for (const double from : {0.0, 0.5, 1.5, 2.5, 4.0, 6.0}) {
      if (fails(d, tables, n, from, d.margins.at("trip_displacement_m"))) return n;
    }
  }
  return 17;
}

TEST(DeliveredDelayE2e, TheStatedDelayIsWhereTheDeliveredControllerFails) {
  int limited = 0;
  for (const auto& [law, estimator, number] :
       {std::tuple{"pd", "lpf", 2}, {"lsmc", "kfe", 3}, {"lqr", "lpf", 3}, {"lsmc", "kfe", 1}}) {
    const auto machine = testing::LimitedMachine::draw(static_cast<std::uint64_t>(number));
    const ControllerDesign d = designed(machine, law, estimator, 8);
    if (d.margins.at("certified") != 1) continue;
    const double h = d.sample_time, stated = d.margins.at("delay_margin_s");
    const auto limit = static_cast<DelayLimit>(static_cast<int>(d.margins.at("delay_limit")));
    const rig::RigParameters plant = tuning_plant(d.model, data_sheets(machine));
    const double found = stepped(d, plant) * h;
    fmt::print("{}, {} on machine {}: stated {:.2f} ms, limited by: {}; found {:.0f} ms\n", law, estimator, number,
               1e3 * stated, name_of(limit), 1e3 * found);
    EXPECT_NEAR(stated, found, 0.15 * found + 0.5 * h + 1e-9) << law << " " << number;
    limited += limit == DelayLimit::supervision;
  }
  EXPECT_GT(limited, 1);
}

}  // namespace
}  // namespace whirl::tuning
