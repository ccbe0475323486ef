// Rotors as they stand in plants: what was stated with confidence and was wrong.
#include "whirl/testing/systems/field_rotors.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "whirl/identify/identify.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/testing/systems/odd_rotors.hpp"

namespace whirl::identification {
namespace {

using testing::FieldKind;
using testing::FieldRecord;

// Gains that fell by 2 to 4 % over the run were read as another unbalance and another cubic spring, 60 to 180 standard
// deviations from the truth.
TEST(FieldRotorProperty, ProbesThatWarmUpAreNotReadAsAnotherRotor) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const FieldRecord truth = testing::field_record(FieldKind::warming_probes, 40, seed);
    const RotorIdentification r = identify_rotor_detailed(std::vector<Recording>{truth.record});
    EXPECT_THAT(r.added, ::testing::Contains("gain of the probes drifting in time"));
    for (const auto& [name, value] :
         {std::pair("k1", truth.k1), std::pair("k2", truth.k2), std::pair("c", truth.c), std::pair("e", truth.e)}) {
      const Estimate& e = *r.model.parameter(name);
      EXPECT_LT(std::abs(e.value - value), 4.5 * e.sd)
          << name << " " << e.value << " +- " << e.sd << ", truth " << value;
    }
  }
}

// At 20 dB a drift of 2 % is seen by 1.8 deviations: too little to be taken up, too much to be left out of the interval
// of e (1.4 % off at 4 standard deviations).
TEST(FieldRotorProperty, ADriftOfTheGainTooSmallToBeSeenIsInTheIntervals) {
  const FieldRecord truth = testing::field_record(FieldKind::warming_probes, 20, 55006);
  const IdentifiedModel model = identify_rotor(truth.record);
  const Estimate& e = *model.parameter("e");
  EXPECT_LT(std::abs(e.value - truth.e), 3 * e.sd) << e.value << " +- " << e.sd << ", truth " << truth.e;
}

// The lag of a notch above the speeds was stated as a disc that tilts, e 34 % off at 27 standard deviations, though a
// mode explains the record as well.
TEST(FieldRotorProperty, ANotchIsNotADiscThatTilts) {
  const FieldRecord truth = testing::field_record(FieldKind::notch, 20, 55004);
  const Identification id = identify(truth.record);
  const Estimate& e = *id.model.parameter("e");
  EXPECT_LT(std::abs(e.value - truth.e), 3 * e.sd) << e.value << " +- " << e.sd << ", truth " << truth.e;
  EXPECT_FALSE(id.model.ambiguities.empty());
}

// A shaft that heats on one side was none of the terms: a quarter of a minute of search, and c and e stated wrong or
// distrusted.
TEST(FieldRotorProperty, ABowThatGrowsIsNamed) {
  for (const double snr : {20.0, 40.0}) {
    SCOPED_TRACE(snr);
    const testing::OddRecord truth = testing::odd_record(testing::OddKind::growing_bow, snr, 84001);
    const RotorIdentification r = identify_rotor_detailed(std::vector<Recording>{truth.record});
    EXPECT_THAT(r.added, ::testing::ElementsAre("bow growing in time"));
    for (const auto& [name, value] :
         {std::pair("k1", truth.k1), std::pair("k2", truth.k2), std::pair("c", truth.c), std::pair("e", truth.e)}) {
      const Estimate& e = *r.model.parameter(name);
      EXPECT_LT(std::abs(e.value - value), 4 * e.sd) << name << " " << e.value << " +- " << e.sd << ", truth " << value;
    }
  }
}

// The rest shows no critical speed, and read the bow that grows as something else: "parts of them give different
// parameters" was said of the right model.
TEST(FieldRotorProperty, ARestThatReadsInTwoWaysContradictsOnlyWhereBothDo) {
  const Identification id = identify(testing::odd_record(testing::OddKind::growing_bow, 40, 84001).record);
  EXPECT_EQ(id.summary.distrust(), nullptr);
  EXPECT_EQ(id.summary.status, Status::ok) << id.summary.trust;
}

// Both are followed by a disc that tilts: over all frequencies to 1.03 times the noise, at those of the motion to 1.5
// and 2.1. It was stated: k1 1 % off at 7 standard deviations.
TEST(FieldRotorProperty, JitterAndHumAreNoDiscThatTilts) {
  for (const auto& [kind, seed] : {std::pair(FieldKind::jitter, 85003U), std::pair(FieldKind::hum, 85003U)}) {
    SCOPED_TRACE(seed);
    const Identification id = identify(testing::field_record(kind, 40, seed).record);
    EXPECT_EQ(id.model.parameter("k_tilt"), nullptr);
    EXPECT_NE(id.summary.status, Status::ok);
  }
}

// The floor shakes with the machine beside it: what is found is a motion that does not decay, at that machine's
// frequency.
TEST(FieldRotorProperty, AMachineBesideItReadsAsAModeThatDoesNotDecay) {
  const FieldRecord truth = testing::field_record(FieldKind::neighbour, 40, 85004);
  const Identification id = identify(truth.record);
  ASSERT_NE(id.model.parameter("second_frequency"), nullptr);
  EXPECT_THAT(id.summary.trust, ::testing::HasSubstr("does not decay: a vibration from outside"));
}

// The instant of a change belongs to the record that holds it: another run was predicted with the old machine up to the
// same time after its start, 13 to 26 times farther off than stated.
TEST(FieldRotorProperty, AnotherRunIsPredictedWithTheMachineAsItIsNow) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SCOPED_TRACE(seed);
    const FieldRecord truth = testing::field_record(FieldKind::slipped_disc, 40, seed);
    const IdentifiedModel model = identify_rotor(truth.record);
    ASSERT_NE(model.parameter("unbalance_step_time"), nullptr);
    const Validation other = validate(model, truth.other), own = validate(model, truth.record);
    EXPECT_LT(other.rmse_x, other.band_x);
    EXPECT_LT(other.rmse_y, other.band_y);
    EXPECT_LT(own.rmse_x, own.band_x);
    EXPECT_TRUE(other.after_change);
    EXPECT_FALSE(own.after_change);
  }
}

}  // namespace
}  // namespace whirl::identification
