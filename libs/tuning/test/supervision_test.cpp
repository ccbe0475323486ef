#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "foreign_designs.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/tuning/off_nominal.hpp"

namespace whirl::tuning {
namespace {

struct Watched {
  double first = -1;  ///< s at which a bit stood
  std::uint32_t word = 0;
  bool trip = false;
  double peak = 0;  ///< m, after `from`
};

/// One run; `change` is done to the machine at 2 s.
template <class Change>
Watched run(const ControllerDesign& d, const testing::ForeignMachine& m, std::uint64_t seed, double from,
            const Change& change) {
  control::Controller controller = control::make_controller(d);
  testing::ForeignRig rig(m, seed);
  Watched out;
  for (; !rig.done(); rig.advance()) {
    const Measurement r = rig.read();
    if (std::abs(r.t - 2) < 5e-4) change(rig.machine());
    const auto u = controller.step(r);
    out.trip = out.trip || !u;
    rig.write(u && !out.trip ? *u : Command{});
    const std::uint32_t word = controller.state().supervision.word;
    if (word != 0 && out.first < 0) out.first = r.t;
    out.word |= word;
    if (r.t > from) out.peak = std::max(out.peak, std::hypot(rig.x(), rig.y()));
  }
  return out;
}

// Machines that are as they were identified, with other noise: nothing may be found.
TEST(SupervisionProperty, NoFalseAlarmOnNominalRunsOfForeignMachines) {
  int runs = 0, alarms = 0;
  for (std::uint64_t machine = 1; machine <= 4; ++machine) {
    testing::ForeignMachine m = testing::ForeignMachine::draw(machine, 0.05);
    m.down = 5, m.still = 0.2;
    for (const auto& [law, estimator] : {std::pair{"pd", "lpf"}, std::pair{"lsmc", "kfe"}}) {
      const ControllerDesign d = designed(m, law, estimator);
      ASSERT_EQ(d.parameters.at("supervise"), 1);
      for (std::uint64_t seed = 1; seed <= 2; ++seed, ++runs) {
        const Watched w = run(d, m, 100 * machine + seed, 1, [](testing::ForeignMachine&) {});
        alarms += w.word != 0;
        EXPECT_EQ(w.word, 0u) << law << " " << estimator << " machine " << machine << ": "
                              << control::supervision_text(w.word) << " at " << w.first << " s";
      }
    }
  }
  std::printf("%d alarms in %d runs\n", alarms, runs);
}

// The unbalance turned by half a turn in mid-run: found within 100 ms, and what is left is far below what a feedforward
// of the wrong phase makes of it.
TEST(SupervisionProperty, TurnedUnbalanceIsFoundAndFollowed) {
  for (std::uint64_t machine = 1; machine <= 3; ++machine) {
    testing::ForeignMachine m = testing::ForeignMachine::draw(machine, 0.05);
    m.down = 5, m.still = 0.2;
    ControllerDesign d = designed(m, "pd", "lpf");
    const auto turn = [](testing::ForeignMachine& now) { now.unbalance_angle += std::numbers::pi; };
    const Watched with = run(d, m, machine, 2.6, turn);
    d.parameters["supervise"] = 0;
    const Watched without = run(d, m, machine, 2.6, turn);
    EXPECT_GE(with.first, 2.0) << machine;
    EXPECT_LE(with.first, 2.1) << machine;
    EXPECT_NE(with.word & control::kFeedforwardReplaced, 0u) << control::supervision_text(with.word);
    EXPECT_FALSE(with.trip);
    EXPECT_LT(with.peak, 0.5 * without.peak) << machine;
    std::printf("machine %d: found after %.0f ms, peak %.3f mm, %.3f mm without supervision\n",
                static_cast<int>(machine), 1e3 * (with.first - 2), 1e3 * with.peak, 1e3 * without.peak);
  }
}

// The 18 conditions on the default rig: with supervision no segment above 1.05 of the open loop, changes found within
// 100 ms.
TEST(SupervisionE2e, OffNominalConditionsStayBelowTheOpenLoop) {
  const rig::RigParameters rig;
  IdentifiedModel model;
  model.rotor = rig.true_model();
  model.rotor->k1_conj = model.rotor->c_conj = 0;
  model.rotor->eps *= std::polar(0.96, 0.07);
  for (const auto& [law, estimator] :
       {std::pair{"pd", "lpf"}, std::pair{"tsmc", "kfe"}, std::pair{"pd_notch", "lpf"}}) {
    DesignOptions o;
    o.law = law;
    o.estimator = estimator;
    o.feedforward = !std::string(law).starts_with("pd_");
    o.hardware = data_sheet(rig);
    o.evaluations = 16;
    const ControllerDesign d = design(model, o);
    EXPECT_EQ(ClosedLoopPlant(rig).run(d).supervision, 0u) << law;
    for (const OffNominalCase& c : off_nominal(d, rig, 3)) {
      EXPECT_LE(c.worst_with, 1.05) << law << ", " << c.name << ", without " << c.worst_without << ": "
                                    << control::supervision_text(c.word);
      if (c.change > 0 && c.detected >= 0) {
        EXPECT_LE(c.detected, 0.1) << law << ", " << c.name;
      }
    }
  }
}

TEST(SupervisionUnit, TheStatusWordIsWritten) {
  EXPECT_EQ(control::supervision_text(0), "");
  EXPECT_EQ(control::supervision_text(control::kGainLowered | control::kGrowth),
            "gain lowered (growth of motion beside the synchronous one)");
  EXPECT_EQ(control::supervision_text(control::kSaturation), "watched (force at its limit)");
}

}  // namespace
}  // namespace whirl::tuning
