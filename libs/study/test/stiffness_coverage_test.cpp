#include <gtest/gtest.h>

#include "whirl/modal/stiffness.hpp"
#include "whirl/rig/records.hpp"

namespace whirl::study {
namespace {

TEST(StiffnessProperty, IntervalsHoldTheStiffnessOfTheRigAsOftenAsTheySay) {
  const rig::RigParameters rig;
  const double k1 = rig.rotor.stiffness * (1 + rig.rotor.stiffness_split), k2 = rig.rotor.cubic;
  const int tests = 200;
  int k1_held = 0, k2_held = 0;
  for (int seed = 1; seed <= tests; ++seed) {
    rig::StiffnessTestOptions test;
    test.seed = static_cast<std::uint64_t>(seed);
    const rig::StiffnessTable table = rig::simulate_stiffness_test(rig, test);
    const StiffnessLaw law = modal::fit_stiffness(table.deflection, table.force);
    k1_held += law.k1.low < k1 && k1 < law.k1.high;
    k2_held += law.k2.low < k2 && k2 < law.k2.high;
  }
  for (const int held : {k1_held, k2_held}) {
    EXPECT_GE(held, 0.90 * tests);
    EXPECT_LE(held, 0.99 * tests);
  }
}

}  // namespace
}  // namespace whirl::study
