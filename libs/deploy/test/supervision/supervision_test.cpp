#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>
#include <vector>

#include "../step_difference.hpp"
#include "supervised_design.hpp"
#include "whirl/testing/control/foreign_rig.hpp"

namespace whirl::deploy {
namespace {

ControllerDesign design_for(const testing::ForeignMachine& m, const char* law, const char* estimator) {
  ControllerDesign d = supervised_design(m, law, estimator);
  // tsmc_paper: nothing but its feedback carries the unbalance
  if (d.law.starts_with("pd_") || d.law == "tsmc_paper") d.feedforward = false;
  return d;
}

/// The library and the exported C on one rig, tick by tick.
struct SideBySide {
  SideBySide(const ControllerDesign& design, const testing::ForeignMachine& machine, std::uint64_t seed)
      : exported(design), controller(control::make_controller(design)), rig(machine, seed) {}

  /// One tick of both: the command of the library, nothing where it trips; `alike` is lost where the C says otherwise.
  std::optional<Command> step() {
    const Measurement r = rig.read();
    const double in[] = {r.x, r.y, r.beta, r.omega, r.omega_dot};
    double out[3];
    const int status = exported.go(in, 1, out);
    const auto answer = controller.step(r);
    word = controller.state().supervision.word;
    alike = alike && status == (answer ? 0 : 4) && static_cast<std::uint32_t>(out[2]) == word;
    const Command u = answer ? *answer : Command{};
    largest = std::max({largest, std::abs(u.ux), std::abs(u.uy)});
    off = std::max({off, std::abs(out[0] - u.ux), std::abs(out[1] - u.uy)});
    rig.write(u);
    rig.advance();
    return answer ? std::optional(u) : std::nullopt;
  }

  Exported exported;
  control::Controller controller;
  testing::ForeignRig rig;
  std::uint32_t word = 0;
  double largest = 0, off = 0;
  bool alike = true;
};

// Unbalance turned, readings lost, motion that grows beside the synchronous one: every step down to the trip, tick by
// tick the same as the library.
TEST(SupervisionExport, TheExportedStepTakesTheStepsOfTheLibrary) {
  const std::pair<const char*, const char*> pairs[] = {{"pd", "lpf"},       {"pd", "kfe"},     {"lsmc", "eso"},
                                                       {"pd_notch", "lpf"}, {"pid", "kalman"}, {"tsmc_paper", "lpf"}};
  testing::ForeignMachine m = testing::ForeignMachine::draw(4, 0.05);
  m.down = 6;
  for (const auto& [law, estimator] : pairs) {
    const std::string what = std::string(law) + " " + estimator;
    const ControllerDesign d = design_for(m, law, estimator);
    const Exported exported(d);
    const auto go = exported.go;
    control::Controller controller = control::make_controller(d);
    testing::ForeignRig rig(m, 3);
    double largest = 0, off = 0;
    std::uint32_t words = 0;
    int trips = 0;
    for (long k = 0; k < 3500; ++k) {
      if (k == 1000) rig.machine().unbalance_angle += std::numbers::pi;
      Measurement r = rig.read();
      r.valid = k < 600 || k > 640;
      if (k > 2000) {
        const double growth = std::min(1e-5 * std::exp(0.004 * static_cast<double>(k - 2000)), 5e-3);
        r.x += growth * std::cos(0.29 * static_cast<double>(k)),
            r.y += growth * std::sin(0.29 * static_cast<double>(k));
      }
      const double in[] = {r.x, r.y, r.beta, r.omega, r.omega_dot};
      double out[3];
      const int status = go(in, r.valid ? 1 : 0, out);
      const auto answer = controller.step(r);
      const Command u = answer ? *answer : Command{};
      const std::uint32_t word = controller.state().supervision.word;
      ASSERT_EQ(status, answer ? 0 : answer.error() == control::kSupervision ? 4 : -1) << what << " " << k;
      ASSERT_EQ(static_cast<std::uint32_t>(out[2]), word) << what << " " << k;
      words |= word;
      trips += status == 4;
      largest = std::max({largest, std::abs(u.ux), std::abs(u.uy)});
      off = std::max({off, std::abs(out[0] - u.ux), std::abs(out[1] - u.uy)});
      rig.write(u);
      rig.advance();
    }
    EXPECT_LE(off, 1e-12 * largest) << what;
    EXPECT_GT(trips, 0) << what;
    for (const std::uint32_t bit :
         {control::kSensorLost, control::kGrowth, control::kFeedbackOff, control::kForceOff}) {
      EXPECT_NE(words & bit, 0u) << what << " " << control::supervision_text(words);
    }
    if (d.feedforward && std::string(estimator) != "kfe" && std::string(estimator) != "eso") {
      EXPECT_NE(words & control::kFeedforwardPhase, 0u) << what << " " << control::supervision_text(words);
    }
  }
}

// Commands that arrive samples too late under a law of high gain: a start that is at its limit again and again, a gain
// that comes back and brings the motion back, answered at the tick of the library.
TEST(SupervisionExport, LateCommandsAreAnsweredAtTheTickOfTheLibrary) {
  testing::ForeignMachine m = testing::ForeignMachine::draw(4, 0.05);
  m.down = 6;
  int starts = 0, relapses = 0;
  for (const auto& [kd, limit] : {std::pair{100.0, 1.0}, std::pair{100.0, 20.0}}) {
    ControllerDesign d = design_for(m, "pd", "lpf");
    d.parameters["cutoff"] = 190, d.parameters["kd"] = kd;
    d.force_limit *= limit;
    const Exported exported(d);
    for (const std::size_t late : {4, 5}) {
      exported.library->get<int()>("start")();
      control::Controller controller = control::make_controller(d);
      testing::ForeignRig rig(m, 7);
      std::vector<Command> sent(late);
      std::uint32_t last = 0;
      double first = 0, largest = 0, off = 0;
      int lowered = 0;
      for (long k = 0; k < 4000; ++k) {
        const Measurement r = rig.read();
        const double in[] = {r.x, r.y, r.beta, r.omega, r.omega_dot};
        double out[3];
        exported.go(in, 1, out);
        const auto answer = controller.step(r);
        const Command u = answer ? *answer : Command{};
        const std::uint32_t word = controller.state().supervision.word;
        ASSERT_EQ(static_cast<std::uint32_t>(out[2]), word) << kd << ", " << late << ": " << k;
        if ((word & control::kGrowth) != 0 && first == 0) first = r.t;
        const std::uint32_t less = control::kGainLowered | control::kFeedbackOff;
        lowered += (word & less) != 0 && (last & less) == 0;
        last = word;
        largest = std::max({largest, std::abs(u.ux), std::abs(u.uy)});
        off = std::max({off, std::abs(out[0] - u.ux), std::abs(out[1] - u.uy)});
        sent.push_back(u);
        if (k == 1000) sent.insert(sent.end(), 3, u);  // later still while the gain is low
        rig.write(sent.front());
        sent.erase(sent.begin());
        rig.advance();
      }
      EXPECT_LE(off, 1e-12 * largest) << kd << ", " << late;
      starts += first > 0.08 && first < 0.12;
      relapses += lowered > 1;
    }
  }
  EXPECT_GT(starts, 0);
  EXPECT_GT(relapses, 0);
}

// An actuator lost, of the wrong sign, 8 ms late: found at the same tick, with the same reason.
TEST(SupervisionExport, FaultsOfTheForceAreFoundAtTheTickOfTheLibrary) {
  testing::ForeignMachine m = testing::ForeignMachine::draw(4, 0.05);
  m.down = 6;
  for (const auto& [law, estimator] : {std::pair{"pd", "lpf"}, std::pair{"lsmc", "kfe"}}) {
    const ControllerDesign d = design_for(m, law, estimator);
    for (const std::uint32_t bit : {control::kForceLost, control::kForceReversed, control::kForceLate}) {
      SideBySide both(d, m, 5);
      long trip = -1, found = -1;
      // A late force ends within a second, the others at once.
      const bool fades = bit == control::kForceLate;
      for (long k = 0; k < (fades ? 2700 : 1600) && trip < 0; ++k) {
        if (k == 1500) {
          if (bit == control::kForceLost) both.rig.machine().gain = 0;
          if (bit == control::kForceReversed) both.rig.machine().gain *= -1;
          if (bit == control::kForceLate) both.rig.machine().delay += 8e-3;
        }
        const auto answer = both.step();
        ASSERT_TRUE(both.alike) << law << " " << k;
        if (found < 0 && (both.word & bit) != 0) {
          found = k;
          EXPECT_NE(both.word & control::kForceOff, 0u) << law << " " << bit;
          EXPECT_EQ(!answer, !fades) << law << " " << bit;
        }
        if (!answer) {
          trip = k;
          EXPECT_NE(both.word & bit, 0u) << law << " " << bit << ": " << control::supervision_text(both.word);
        }
      }
      EXPECT_GE(found, 1500) << law << " " << bit;
      EXPECT_LE(found, 1550) << law << " " << bit;
      EXPECT_GE(trip, 1500) << law << " " << bit;
      EXPECT_LE(trip, fades ? 2560 : 1550) << law << " " << bit;
      EXPECT_LE(both.off, 1e-12 * both.largest) << law << " " << bit;
    }
  }
}

// Actuators that are dead from the first tick on: let go and found at the tick of the library.
TEST(SupervisionExport, ActuatorsDeadFromTheFirstTickAreFoundAtTheTickOfTheLibrary) {
  testing::ForeignMachine m = testing::ForeignMachine::draw(4, 0.05);
  m.down = 6;
  int tested = 0;
  for (const auto& [law, estimator] : {std::pair{"pd", "lpf"}, std::pair{"lsmc", "kfe"}}) {
    const ControllerDesign d = design_for(m, law, estimator);
    SideBySide both(d, m, 6);
    both.rig.machine().gain = 0;
    long trip = -1;
    for (long k = 0; k < 500 && trip < 0; ++k) {
      if (!both.step()) trip = k;
      ASSERT_TRUE(both.alike) << law << " " << k;
      tested += (both.word & control::kForceTested) != 0;
    }
    EXPECT_GE(trip, 0) << law;
    EXPECT_NE(both.word & control::kForceLost, 0u) << law;
  }
  EXPECT_GT(tested, 0);
}

// An unbalance that trebles looks like a force of the wrong sign until it is let go: the same ticks, and no trip.
TEST(SupervisionExport, AnUnbalanceThatTreblesIsToldFromAWrongForceAtTheTickOfTheLibrary) {
  testing::ForeignMachine m = testing::ForeignMachine::draw(4, 0.05);
  m.down = 6;
  for (const auto& [law, estimator] : {std::pair{"pd", "lpf"}, std::pair{"lsmc", "kfe"}}) {
    const ControllerDesign d = design_for(m, law, estimator);
    SideBySide both(d, m, 5);
    std::uint32_t words = 0;
    for (long k = 0; k < 2500; ++k) {
      if (k == 1500) both.rig.machine().unbalance *= 3;
      const auto answer = both.step();
      words |= both.word;
      ASSERT_TRUE(answer) << law << " " << k << ": " << control::supervision_text(words);
      ASSERT_TRUE(both.alike) << law << " " << k;
    }
    EXPECT_LE(both.off, 1e-12 * both.largest) << law;
    EXPECT_NE(words & control::kForceTested, 0u) << law << ": " << control::supervision_text(words);
    EXPECT_NE(words & control::kUnbalanceChanged, 0u) << law << ": " << control::supervision_text(words);
  }
}

// At rest at full speed, as simulators begin, with a force that acts up to 2.5 ms earlier or later than designed for:
// nothing is found; an actuator that is lost soon after is; the same ticks in C.
TEST(SupervisionExport, AStartFromRestAtFullSpeedIsNoFaultOfTheForce) {
  constexpr std::uint32_t kFault = control::kForceLost | control::kForceReversed | control::kForceLate;
  int runs = 0, trips = 0, losses = 0;
  long slowest = 0;
  for (const auto& [law, estimator] :
       {std::pair{"pd", "lpf"}, {"pd", "kfe"}, {"lsmc", "kfe"}, {"tsmc", "eso"}, {"pd_notch", "lpf"}}) {
    for (std::uint64_t number = 51; number < 63; ++number) {
      testing::ForeignMachine m = testing::ForeignMachine::draw(number, 0.05);
      m.down = 6;
      m.from_rest = true;
      for (const double shift : {-2.5e-3, -1.5e-3, 0.0, 1.5e-3, 2.5e-3}) {
        ControllerDesign d = design_for(m, law, estimator);
        d.delay = std::max(d.delay + shift, m.age);
        std::unique_ptr<Exported> exported;
        if (number == 51 && shift == 1.5e-3) exported = std::make_unique<Exported>(d);
        for (const long lost : {100000L, 40L}) {
          if (lost < 1000 && (shift != 0 || !d.feedforward)) continue;  // without feedforward the force grows from zero
          control::Controller controller = control::make_controller(d);
          testing::ForeignRig rig(m, number);
          long trip = -1;
          for (long k = 0; k < 400 && trip < 0; ++k) {
            if (k == lost) rig.machine().gain = 0;
            const Measurement r = rig.read();
            const auto answer = controller.step(r);
            const std::uint32_t word = controller.state().supervision.word;
            if (exported) {
              const double in[] = {r.x, r.y, r.beta, r.omega, r.omega_dot};
              double out[3];
              ASSERT_EQ(exported->go(in, 1, out), answer ? 0 : 4) << law << " " << k;
              ASSERT_EQ(static_cast<std::uint32_t>(out[2]), word) << law << " " << k;
            }
            if ((word & kFault) != 0 || !answer) trip = k;
            rig.write(answer ? *answer : Command{});
            rig.advance();
          }
          if (lost > 1000) {
            ++runs, trips += trip >= 0;
            EXPECT_LT(trip, 0) << law << " " << estimator << " machine " << number << ", " << 1e3 * shift
                               << " ms: " << control::supervision_text(controller.state().supervision.word);
          } else {
            ++losses;
            EXPECT_GE(trip, lost) << law << " " << estimator << " machine " << number << ", lost at " << lost;
            EXPECT_LE(trip, lost + 100) << law << " " << estimator << " machine " << number << ", lost at " << lost;
            slowest = std::max(slowest, trip - lost);
          }
        }
      }
    }
  }
  std::printf("%d trips in %d starts; %d losses found after %ld ms at most\n", trips, runs, losses, slowest);
}

// A design without supervision is exported without a line of it.
TEST(SupervisionExport, NothingOfItWithoutIt) {
  ControllerDesign d = design_for(testing::ForeignMachine::draw(4), "pd", "lpf");
  EXPECT_NE(controller_code(d, {"drive", false, ""}).source.text.find("watch"), std::string::npos);
  d.parameters["supervise"] = 0;
  const ControllerCode code = controller_code(d, {"drive", false, ""});
  EXPECT_EQ(code.source.text.find("watch"), std::string::npos);
  EXPECT_EQ(code.header.text.find("WATCH"), std::string::npos);
}

}  // namespace
}  // namespace whirl::deploy
