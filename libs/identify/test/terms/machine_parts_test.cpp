// Parts that real machines have beside shaft, damping and unbalance: at 40 dB each is found by its name, and the rotor
// beside it is right within its intervals.
#include "whirl/testing/systems/machine_parts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "whirl/identify/identify.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification {
namespace {

using namespace testing;

struct PartSeed {
  Part part;
  unsigned seed;
};
class MachinePartProperty : public ::testing::TestWithParam<PartSeed> {};

TEST_P(MachinePartProperty, IsFoundByItsName) {
  const auto [part, seed] = GetParam();
  const auto named = std::ranges::find(kParts, part, &PartName::part);
  const PartRecord truth = part_record(part, 40, seed);
  const RotorIdentification r = identify_rotor_detailed(std::vector<Recording>{truth.record});
  EXPECT_THAT(r.added, ::testing::Contains(named->label));
  if (part == Part::keyway) {  // the cubic spring of a shaft that sags is none of the terms: said, and not trusted
    EXPECT_EQ(r.model.summary.status, Status::warning);
    return;
  }
  EXPECT_LT(r.chi_square_weak, 1.3);
  for (const auto& [name, value] :
       {std::pair("k1", truth.k1), std::pair("k2", truth.k2), std::pair("c", truth.c), std::pair("e", truth.e)}) {
    const Estimate& e = *r.model.parameter(name);
    EXPECT_LT(std::abs(e.value - value), 4.5 * e.sd) << name << " " << e.value << " +- " << e.sd << ", truth " << value;
  }
}
INSTANTIATE_TEST_SUITE_P(Parts, MachinePartProperty,
                         ::testing::Values(PartSeed{Part::blade_loss, 1}, PartSeed{Part::blade_loss, 2},
                                           PartSeed{Part::loose_bolt, 1}, PartSeed{Part::two_clocks, 2},
                                           PartSeed{Part::loss_factor, 1}, PartSeed{Part::keyway, 2},
                                           PartSeed{Part::rubber, 1}, PartSeed{Part::swirl_damping, 1},
                                           PartSeed{Part::rolling_bearing, 2}, PartSeed{Part::film, 1},
                                           PartSeed{Part::preload, 1}, PartSeed{Part::preload, 2}));

// In a forward whirl it is a spring: at 20 dB k1 was stated 2.6 % off at 140 standard deviations.
TEST(MachinePartProperty, SwirlDampingThatIsHiddenInTheStiffnessIsAnAlternative) {
  for (unsigned seed = 20102; seed <= 20104; ++seed) {
    SCOPED_TRACE(seed);
    const PartRecord truth = part_record(Part::swirl_damping, 20, seed);
    const IdentifiedModel model = identify_rotor(truth.record);
    const Estimate& k1 = *model.parameter("k1");
    EXPECT_LT(std::abs(k1.value - truth.k1), 3 * k1.sd) << k1.value << " +- " << k1.sd << ", truth " << truth.k1;
    const bool stated = std::ranges::any_of(model.ambiguities, [](const Ambiguity& a) {
      return std::ranges::any_of(a.alternatives, [](const Alternative& other) {
        return std::ranges::any_of(other.parameters, [](const auto& p) { return p.first == "c_cross"; });
      });
    });
    EXPECT_TRUE(stated);
  }
}

// The law of friction near rest is assumed: a change of the unbalance at 5 Hz took its place, and e was 12 % off at 18
// standard deviations with status ok.
TEST(MachinePartProperty, AChangeOfTheUnbalanceBesideDryFrictionIsNotSure) {
  for (const unsigned seed : {4012U, 4036U}) {
    SCOPED_TRACE(seed);
    const DrawnMachine drawn = draw_machine(Oddity::coulomb, seed);
    const IdentifiedModel model = identify_rotor(machine_record(drawn, 40, seed));
    const Estimate& e = *model.parameter("e");
    EXPECT_LT(std::abs(e.value - drawn.machine.e), 3 * e.sd) << e.value << " +- " << e.sd;
    EXPECT_EQ(model.summary.status, Status::warning);
  }
}

// A model of what was before a change does not predict what is after it: that is no evidence against the model of both.
TEST(MachinePartProperty, APartHeldOutAfterAChangeIsNoEvidence) {
  int after = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const PartRecord truth = part_record(Part::loose_bolt, 40, seed);
    const Identification id = identify(truth.record);
    SCOPED_TRACE(seed);
    EXPECT_EQ(id.summary.find(FindingCode::held_out_not_predicted), nullptr);
    EXPECT_EQ(id.summary.find(FindingCode::parameter_differs), nullptr);
    const Finding* open = id.summary.find(FindingCode::held_out_cannot_check);
    if (open == nullptr || !std::isfinite(open->amount("instant"))) continue;
    ++after;
    EXPECT_NEAR(open->amount("instant"), truth.instant, 0.02);
  }
  EXPECT_GT(after, 0);
}

}  // namespace
}  // namespace whirl::identification
