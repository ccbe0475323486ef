// An actuator that is lost, of the wrong sign or late: found within 50 ms, and never in sound runs.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "foreign_designs.hpp"
#include "rig_design.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::tuning {
namespace {

/// With these numbers, as a search finds them; else with those that it starts from.
ControllerDesign rig_design(const std::string& law, const std::string& estimator,
                            const std::map<std::string, double>& numbers = {}) {
  const rig::RigParameters rig;
  IdentifiedModel model = round_model(rig);
  model.rotor->eps *= std::polar(0.96, 0.07);
  DesignOptions o = options_of(data_sheet(rig), law, estimator);
  o.fixed = numbers;
  return watched_design(model, o);
}

const std::vector<ControllerDesign>& designs() {
  static const std::vector<ControllerDesign> all{
      rig_design("pd", "lpf"),
      rig_design("tsmc", "kfe", {{"boundary_layer", 0.0216277}, {"cancel", 0.981841}, {"delta", 2.19296e-6}}),
      rig_design("pd_notch", "lpf",
                 {{"adaptation", 3.4253}, {"cancel", 1}, {"cutoff", 191.868}, {"kd", 86.8567}, {"kp", 2941.81}}),
      rig_design("lqr", "eso"), rig_design("lsmc", "difference")};
  return all;
}

struct Found {
  double at = -1;  ///< s; negative: never
  double motion = 0;
  std::uint32_t word = 0;
};

/// One run until a fault of the force is found; a lost or reversed one trips then. From `start` on the force has these
/// signs.
Found run(const ControllerDesign& d, const rig::RigParameters& p, const rig::RigRun& experiment, double start = 1e9,
          double sign_x = 1, double sign_y = 1, double end = 1e9) {
  control::Controller controller = control::make_controller(d);
  rig::VirtualRig rig(rig::make_rig_tables(p), experiment);
  const rig::RigTruth truth(rig);
  Found out;
  for (; !rig.done() && out.at < 0; rig.advance()) {
    const Measurement m = rig.read();
    if (m.t > end) break;
    const auto u = controller.step(m);
    const bool wrong = m.t >= start;
    rig.write(u ? Command{(wrong ? sign_x : 1) * u->ux, (wrong ? sign_y : 1) * u->uy} : Command{});
    out.word = controller.state().supervision.word;
    if (!u || (out.word & control::kForceLate) != 0) out.at = m.t, out.motion = std::abs(truth.z());
  }
  return out;
}

// The default rig, five designs, from above resonance to below it.
TEST(ForceCheckProperty, LossWrongSignAndDelayAreFoundWithin50MillisecondsBelowAQuarterOfTheOpenPeak) {
  const rig::RigParameters p;
  const double peak = ClosedLoopPlant(p).open().all;
  double slowest = 0, largest = 0;
  int runs = 0;
  for (const ControllerDesign& d : designs()) {
    for (const double t : {3.0123, 4.8371, 5.9117}) {
      const auto check = [&](const char* what, const rig::RigRun& experiment, double sx, double sy, unsigned bits) {
        const Found f = run(d, p, experiment, t, sx, sy, t + 0.3);
        const std::string where =
            fmt::format("{}, {}: {} at {:.1f} s: {:.0f} ms, {:.2f} mm, {}", d.law, d.estimator, what, t,
                        1e3 * (f.at - t), 1e3 * f.motion, control::supervision_text(f.word));
        EXPECT_GE(f.at, t) << where;
        EXPECT_LE(f.at, t + 0.05) << where;
        EXPECT_LE(f.motion, 0.25 * peak) << where;
        EXPECT_NE(f.word & bits, 0u) << where;
        slowest = std::max(slowest, f.at - t);
        largest = std::max(largest, f.motion);
        ++runs;
      };
      using rig::RigAxis;
      using rig::RigFault;
      for (const auto& [name, axis] :
           {std::pair{"loss of both", RigAxis::both}, {"loss of x", RigAxis::x}, {"loss of y", RigAxis::y}}) {
        check(name, {11, {{RigFault::actuator_loss, t, 1e9, axis}}}, 1, 1, control::kForceLost);
      }
      check("8 ms", {12, {{RigFault::extra_delay, t, 1e9, RigAxis::both, 8}}}, 1, 1, control::kForceLate);
      check("wrong sign of both", {13, {}}, -1, -1, control::kForceReversed);
      check("wrong sign of x", {14, {}}, -1, 1, control::kForceReversed | control::kForceLost);
      check("wrong sign of y", {15, {}}, 1, -1, control::kForceReversed | control::kForceLost);
    }
  }
  fmt::print("{} faults: found after {:.0f} ms at most, {:.2f} mm at most ({:.0f} % of the open peak)\n", runs,
             1e3 * slowest, 1e3 * largest, 100 * largest / peak);
}

// With a small level of supervision the residual at top speed stands above its threshold before anything fails. What
// then rises out of it is a fault, no unbalance to be learned.
TEST(ForceCheckProperty, ALossIsFoundWhereTheResidualStoodAboveItsThreshold) {
  using rig::RigAxis;
  for (ControllerDesign d : {rig_design("pd", "kfe"), designs()[1]}) {
    d.parameters["watch_level"] = 60e-6;
    for (const double t : {0.4123, 0.5123}) {
      for (const RigAxis axis : {RigAxis::both, RigAxis::x, RigAxis::y}) {
        for (const std::uint64_t seed : {11U, 12U}) {
          const Found f = run(d, {}, {seed, {{rig::RigFault::actuator_loss, t, 1e9, axis}}}, t, 1, 1, t + 0.3);
          const std::string where =
              fmt::format("{}, {}, axis {} at {} s", d.law, d.estimator, static_cast<int>(axis), t);
          EXPECT_GE(f.at, t) << where;
          EXPECT_LE(f.at, t + 0.05) << where;
          EXPECT_NE(f.word & control::kForceLost, 0u) << where << ": " << control::supervision_text(f.word);
        }
      }
    }
    EXPECT_LT(run(d, {}, {13, {}}).at, 0) << d.law << ": a sound run";
  }
}

// A wrong sign at commissioning: from the first force on.
TEST(ForceCheckProperty, AWrongSignFromTheStartTrips) {
  for (const ControllerDesign& d : designs()) {
    for (const auto& [sx, sy] : {std::pair{-1.0, -1.0}, {-1.0, 1.0}, {1.0, -1.0}}) {
      const Found f = run(d, {}, {21, {}}, 0, sx, sy, 0.3);
      EXPECT_GE(f.at, 0) << d.law << " " << d.estimator << " " << sx << " " << sy;
      EXPECT_LE(f.at, 0.05) << d.law << " " << d.estimator << " " << sx << " " << sy;
    }
  }
}

// Both actuators dead from the first tick on, on a rotor that turns: while the force turns with it, they look like
// twice the unbalance in the same place, until the force is let go. A rotor that has another unbalance is told from it.
TEST(ForceCheckProperty, ActuatorsDeadFromTheFirstTickAreFoundAndOtherUnbalancesAreNot) {
  double slowest = 0;
  for (const ControllerDesign& d : designs()) {
    const std::string what = d.law + " " + d.estimator;
    const Found dead = run(d, {}, {22, {}}, 0, 0, 0, 0.5);
    EXPECT_GE(dead.at, 0) << what;
    EXPECT_LE(dead.at, 0.2) << what;
    EXPECT_NE(dead.word & control::kForceLost, 0u) << what << ": " << control::supervision_text(dead.word);
    slowest = std::max(slowest, dead.at);
    for (const double factor : {0.5, 1.7, 2.0, 2.5}) {
      rig::RigParameters p;
      p.rotor.residual_eccentricity *= factor, p.rotor.added_mass *= factor;
      const Found sound = run(d, p, {23, {}}, 1e9, 1, 1, 1.5);
      EXPECT_LT(sound.at, 0) << what << ", " << factor << ": " << control::supervision_text(sound.word);
    }
  }
  fmt::print("dead from the first tick: found after {:.0f} ms at most\n", 1e3 * slowest);
}

// 100 sound runs: 0 to 5 g, other noise, gains of the actuators and stiffness off by as much as data sheets are.
TEST(ForceCheckProperty, NoFalseTripInAHundredSoundRuns) {
  int runs = 0, trips = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    rig::RigParameters p;
    p.rotor.added_mass *= static_cast<double>(i % 6) / 5;
    p.actuator.gain_error = 0.05 * (static_cast<double>(i % 5) - 2);
    p.rotor.stiffness *= 1 + 0.03 * (static_cast<double>(i % 3) - 1);
    for (const ControllerDesign& d : designs()) {
      const Found f = run(d, p, {500 + i, {}});
      trips += f.at >= 0;
      ++runs;
      EXPECT_LT(f.at, 0) << d.law << " " << d.estimator << " run " << i << ": " << control::supervision_text(f.word);
    }
  }
  EXPECT_EQ(runs, 100);
  EXPECT_EQ(trips, 0);
}

// What changes the unbalance, the angle or the readings is no fault of the force.
TEST(ForceCheckProperty, OtherChangesAreNoFaultOfTheForce) {
  const rig::RigParameters p;
  for (const ControllerDesign& d : designs()) {
    for (const double t : {3.5, 5.5}) {
      rig::ScriptedFault lost{rig::RigFault::unbalance, t, 1e9}, slipped{rig::RigFault::encoder_slip, t, 1e9};
      lost.factor = 0.2;
      slipped.angle = 1.5707963267948966;
      for (const rig::ScriptedFault& f : {lost, slipped, rig::ScriptedFault{rig::RigFault::sensor_loss, t, t + 0.05},
                                          rig::ScriptedFault{rig::RigFault::sensor_stuck, t, t + 0.005}}) {
        const Found r = run(d, p, {31, {f}}, 1e9, 1, 1, t + 1);
        EXPECT_EQ(r.word & (control::kForceLost | control::kForceReversed | control::kForceLate), 0u)
            << d.law << " " << d.estimator << ", fault " << static_cast<int>(f.kind) << " at " << t << " s";
      }
    }
  }
}

struct GapClock {
  rig::VirtualRig& rig;
  long gap = 0;
  long wait() noexcept {
    for (long i = 0; i < gap; ++i) rig.advance();  // the last force stays on
    return std::exchange(gap, 0);
  }
};

// Ticks left out of a real closed loop, with either policy.
TEST(ForceCheckProperty, GapsAreNoFaultOfTheForce) {
  const rig::RigParameters p;
  const auto tables = rig::make_rig_tables(p);
  for (const ControllerDesign& d : designs()) {
    for (const rt::DtPolicy policy : {rt::DtPolicy::nominal, rt::DtPolicy::fill}) {
      control::Controller controller = control::make_controller(d);
      rig::VirtualRig rig(tables, {41, {}});
      GapClock clock{rig};
      rt::SafetyLimits limits;
      limits.force = d.force_limit;
      rt::Loop loop(rig, controller, clock, limits, {.dt = policy});
      long gap = 1;
      for (long k = 1; !rig.done() && rig.time() < 9; ++k) {
        if (k % 500 == 0) clock.gap = gap, gap = gap % 5 + 1;
        const rt::CycleRecord r = loop.cycle();
        ASSERT_EQ(r.trip, Fault::none) << d.law << " " << d.estimator << ", gap " << gap << " at " << rig.time()
                                       << " s: " << control::supervision_text(controller.state().supervision.word);
      }
    }
  }
}

// Machines of a rig written apart, designs from models with the errors of an identification.
TEST(ForceCheckProperty, FaultsOfForeignMachinesAreFoundAndSoundRunsAreNot) {
  double slowest = 0;
  int faults = 0, sound = 0;
  for (const std::uint64_t number : {11U, 13U, 14U}) {
    testing::ForeignMachine m = testing::ForeignMachine::draw(number, 0.05);
    m.down = 5, m.still = 0.2;
    const ControllerDesign d = watched_design(m, "pd", number % 2 == 1 ? "lpf" : "kfe");
    for (int kind = 0; kind < 9; ++kind) {
      control::Controller controller = control::make_controller(d);
      testing::ForeignRig rig(m, 60 + number);
      double at = -1;
      for (; !rig.done() && at < 0; rig.advance()) {
        const Measurement r = rig.read();
        const bool wrong = r.t >= 2;
        if (std::abs(r.t - 2) < 5e-4) {
          if (kind == 0) rig.machine().gain = 0;
          if (kind == 1) rig.machine().gain *= -1;
          if (kind == 2) rig.machine().delay += 8e-3;
        }
        const auto u = controller.step(r);
        Command sent = u ? *u : Command{};
        if (wrong && (kind == 3 || kind == 4)) sent.ux *= kind == 3 ? 0 : -1;
        if (wrong && (kind == 5 || kind == 6)) sent.uy *= kind == 5 ? 0 : -1;
        rig.write(sent);
        // A late force fades after it is found; the others trip.
        if (!u || (kind == 2 && (controller.state().supervision.word & control::kForceLate) != 0)) at = r.t;
        if (kind < 7 && r.t > 2.3) break;
      }
      const std::string what = fmt::format("machine {}, kind {}: {}", number, kind,
                                           control::supervision_text(controller.state().supervision.word));
      if (kind < 7) {
        EXPECT_GE(at, 2) << what;
        EXPECT_LE(at, 2.05) << what;
        slowest = std::max(slowest, at - 2);
        ++faults;
      } else {
        EXPECT_LT(at, 0) << what;
        ++sound;
      }
    }
  }
  fmt::print("{} faults, the slowest found after {:.0f} ms; {} sound runs\n", faults, 1e3 * slowest, sound);
}

}  // namespace
}  // namespace whirl::tuning
