// A rotor with further modes: what `response` and `runup` say against the simulated machine.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/pages/steady_response.hpp"
#include "whirl/response/runup.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::pages {
namespace {

constexpr double kTurnOf = 2 * std::numbers::pi;

IdentifiedModel with_second_critical(double k2) {
  IdentifiedModel m;
  m.method = "stand-in";
  RotorModel r;
  r.k1 = std::pow(kTurnOf * 12, 2);
  r.k2 = k2;
  r.c = 2 * 0.02 * kTurnOf * 12;
  r.eps = std::polar(1e-4, 0.7);
  r.modes = {{kTurnOf * 60, 0.01, std::polar(4e-5, 2.0)}};
  m.rotor = r;
  return m;
}

/// Largest radius of the simulated motion after the transient at a constant speed.
double simulated_radius(const RotorModel& r, double omega) {
  rotor::SpeedProfile profile;
  profile.omega_start = profile.omega_end = omega;
  profile.ramp_time = 8;
  const rotor::Response run = rotor::simulate(r, rotor::angle_signal(profile, 1e-3));
  return run.z.tail(1000).cwiseAbs().maxCoeff();
}

TEST(FurtherModesReference, TheResponseIsThatOfTheSimulatedMachine) {
  for (const double k2 : {0.0, 1e7}) {
    const IdentifiedModel model = with_second_critical(k2);
    for (const double hz : {8.0, 30.0, 55.0, 59.5, 60.5, 70.0}) {
      SteadyOptions o;
      o.curve.from = kTurnOf * hz;
      o.curve.to = kTurnOf * (hz + 0.5);
      const SteadyResponse found = steady_response(model, o);
      ASSERT_FALSE(found.curve.points.empty());
      const response::PeriodicSolution& first = found.curve.points.front().solution;
      EXPECT_NEAR(found.amplitude(first), simulated_radius(*model.rotor, first.omega), 0.005 * found.amplitude(first))
          << hz << " Hz, k2 " << k2;
    }
  }
}

TEST(FurtherModesReference, AMultipleOfTheUnbalanceForcesThemToo) {
  SteadyOptions o;
  o.curve.from = kTurnOf * 58;
  o.curve.to = kTurnOf * 62;
  const IdentifiedModel model = with_second_critical(0);
  const SteadyResponse once = steady_response(model, o);
  o.unbalance = 3;
  const SteadyResponse thrice = steady_response(model, o);
  EXPECT_NEAR(thrice.amplitude(thrice.curve.points.front().solution),
              3 * once.amplitude(once.curve.points.front().solution), 1e-9);
}

TEST(FurtherModesReference, ASlowRunUpPeaksWhereTheResponseDoes) {
  const RotorModel r = *with_second_critical(0).rotor;
  const response::SlowRun slow = response::slow_run(r, kTurnOf * 40, kTurnOf * 80, 4000);
  EXPECT_NEAR(slow.peak, simulated_radius(r, slow.peak_speed), 0.005 * slow.peak);
  EXPECT_NEAR(slow.peak_speed, kTurnOf * 60, 0.02 * kTurnOf * 60);
  const response::Passage run = response::passage(r, kTurnOf * 40, kTurnOf * 80, kTurnOf * 0.5);
  EXPECT_GT(run.peak, 0.9 * slow.peak);
  EXPECT_LT(run.peak, 1.05 * slow.peak);
}

}  // namespace
}  // namespace whirl::pages
