// A rotor with two critical speeds, from its record to its response.
#include "whirl/testing/systems/two_criticals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/identify/identify.hpp"
#include "whirl/pages/steady_response.hpp"

namespace whirl::pages {
namespace {

// A run-up through both, at 40 dB; the truth is integrated apart at constant speeds.
TEST(TwoCriticalsE2e, TheResponseOfTheIdentifiedModelIsThatOfTheMachine) {
  constexpr double kTurns = 2 * std::numbers::pi, kShare = 0.03;
  for (const unsigned seed : {11U}) {
    const testing::TwoCriticals machine = testing::draw_two_criticals(seed);
    const double top = 1.35 * machine.w / kTurns;
    testing::Run run;
    run.from_hz = 3, run.to_hz = top, run.seconds = 20;
    const identification::Identification id =
        identification::identify(testing::two_criticals_record(machine, run, 40, seed));
    ASSERT_NE(id.summary.status, Status::unusable) << seed << ": " << id.summary.warnings.back();
    ASSERT_EQ(id.model.rotor->modes.size(), 1U) << seed;
    EXPECT_NEAR(id.model.rotor->modes[0].omega, machine.w, 0.002 * machine.w) << seed;
    for (const double share : {0.3, 0.6, 0.85, 1.0, 1.2, 1.6, 2.0, 2.4, 2.6, 2.8, 3.2}) {
      const double hz = share * std::sqrt(machine.first.k) / kTurns;
      if (hz > 0.95 * top) continue;
      SteadyOptions o;
      o.curve.from = kTurns * hz;
      o.curve.to = kTurns * (hz + 0.2);
      const SteadyResponse found = steady_response(id.model, o);
      ASSERT_FALSE(found.curve.points.empty());
      const double truth = testing::two_criticals_radius(machine, hz);
      EXPECT_NEAR(found.amplitude(found.curve.points.front().solution), truth, kShare * truth)
          << seed << ", " << hz << " Hz of " << machine.w / kTurns;
    }
  }
}

}  // namespace
}  // namespace whirl::pages
