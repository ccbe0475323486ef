// Rotors that whirl by themselves: internal damping or cross-coupled stiffness beyond the outer damping.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::identification {
namespace {

using namespace whirl::testing;
using ::testing::Contains;
using ::testing::HasSubstr;

/// A run through the critical speed to twice that and beyond: small motion grows from `from` times the critical speed
/// on by internal damping; 0: at any speed, by cross-coupled stiffness.
DrawnMachine self_excited(double from, bool up, unsigned seed) {
  DrawnMachine d = draw_machine(Oddity::none, seed);
  Machine& m = d.machine;
  const double w = std::sqrt(m.k);
  if (from > 0) {
    m.c_rotating = m.c / (from - 1);
  } else {
    m.cross = 1.1 * m.c * w;
  }
  if (up) std::swap(d.run.from_hz, d.run.to_hz);
  return d;
}

RotorIdentification found_in(const DrawnMachine& d, double snr, unsigned seed) {
  return identify_rotor_detailed({rotor_record(machine_record(d, snr, seed))});
}

// Without the force that drives the whirl no trajectory followed these records: "the equations are singular".
TEST(SelfExcitedProperty, TheForceThatDrivesTheWhirlIsFoundAndSaid) {
  for (unsigned seed = 811; seed < 815; ++seed) {
    for (const double from : {1.5, 1.9, 0.0}) {
      const bool up = seed % 2 == 0;
      if (from == 1.5 && !up) continue;  // below
      const DrawnMachine d = self_excited(from, up, seed);
      const RotorIdentification r = found_in(d, 30, seed);
      SCOPED_TRACE(fmt::format("seed {}, from {}, {}", seed, from, up ? "up" : "down"));
      EXPECT_THAT(r.model.summary.warnings, Contains(HasSubstr("whirls by itself")));
      ASSERT_NE(r.model.summary.status, Status::unusable) << r.model.summary.warnings.back();
      EXPECT_THAT(r.added, ::testing::ElementsAre(from > 0 ? "rotating damping" : "cross-coupled stiffness"));
      EXPECT_THAT(r.model.summary.trust, ::testing::Not(HasSubstr("Do not trust")));
      for (const auto& [name, truth] :
           {std::pair("k1", d.machine.k),
            {"k2", d.machine.cubic},
            {"c", d.machine.c},
            {"e", d.machine.e},
            from > 0 ? std::pair("c_rotating", d.machine.c_rotating) : std::pair("k_cross", d.machine.cross)}) {
        const Estimate* e = r.model.parameter(name);
        ASSERT_NE(e, nullptr) << name;
        EXPECT_LT(std::abs(e->value - truth), 4.5 * e->sd) << name;
      }
    }
  }
}

// A run-down out of a whirl at three times the critical speed, which falls back on the way: no one motion follows it.
// The reason is said with what parts of the record show.
TEST(SelfExcitedProperty, WhereNoMotionFollowsAWholeRecordTheReasonIsSaid) {
  const DrawnMachine d = self_excited(1.5, false, 813);
  const IdentifiedModel m = found_in(d, 30, 813).model;
  EXPECT_EQ(m.summary.status, Status::unusable);
  const auto said =
      std::ranges::find_if(m.summary.warnings, [](const auto& w) { return w.find("whirls by itself from") != w.npos; });
  ASSERT_NE(said, m.summary.warnings.end());
  const std::string name = "c_rotating = ";
  EXPECT_NEAR(std::stod(said->substr(said->find(name) + name.size())) / d.machine.c_rotating, 1, 0.01) << *said;
}

}  // namespace
}  // namespace whirl::identification
