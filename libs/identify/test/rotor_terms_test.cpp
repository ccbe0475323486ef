#include "whirl/identify/rotor_terms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "found_in.hpp"
#include "whirl/identify/identify.hpp"

namespace whirl::identification {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

void expect_close(const RotorIdentification& r, const char* name, double truth) {
  const Estimate& e = *r.model.parameter(name);
  EXPECT_LT(std::abs(e.value - truth), 4.5 * e.sd) << name << " " << e.value << " +- " << e.sd << ", truth " << truth;
}

struct Named {
  Oddity oddity;
  const char* label;
};
class RotorTermProperty : public ::testing::TestWithParam<Named> {};

// At 40 dB what the machine has is found by its name, and the rotor beside it is right within its intervals.
TEST_P(RotorTermProperty, IsFoundByName) {
  for (const unsigned seed : {101U, 102U}) {
    const Machine m = draw_machine(GetParam().oddity, seed).machine;
    const RotorIdentification r = found_in(GetParam().oddity, seed, 40);
    EXPECT_THAT(r.added, Contains(GetParam().label)) << seed;
    EXPECT_LT(r.chi_square_weak, 1.3) << seed;
    expect_close(r, "k1", m.k);
    expect_close(r, "k2", m.cubic);
    expect_close(r, "c", m.c);
    expect_close(r, "e", m.e);
  }
}
INSTANTIATE_TEST_SUITE_P(
    Machines, RotorTermProperty,
    ::testing::Values(Named{Oddity::quintic, "quintic stiffness"}, Named{Oddity::gyroscopic, "gyroscopic term"},
                      Named{Oddity::sensor_gain, "sensor gain"}, Named{Oddity::sensor_angle, "sensor angle"},
                      Named{Oddity::quadratic_damping, "quadratic damping"}, Named{Oddity::coulomb, "Coulomb friction"},
                      Named{Oddity::anisotropic, "anisotropic stiffness"}));

// A bow reads as runout with another unbalance: both are said, and the interval of e holds the truth.
TEST(RotorAmbiguityProperty, BowBesideRunoutIsSaidAndCovered) {
  for (const unsigned seed : {111U, 112U, 113U}) {
    const Machine m = draw_machine(Oddity::bow, seed).machine;
    const RotorIdentification r = found_in(Oddity::bow, seed, 30);
    bool said = false;
    for (const Ambiguity& a : r.model.ambiguities)
      said = said || a.readings.find("bow of the shaft") != std::string::npos;
    EXPECT_TRUE(said) << seed;
    EXPECT_TRUE(r.model.parameter("e")->covers(m.e)) << seed;
    expect_close(r, "k2", m.cubic);
  }
}

// One run-down cannot tell a drift in time from a change with speed; the interval of c holds both readings.
TEST(RotorAmbiguityProperty, DampingInTimeOrWithSpeedIsCovered) {
  for (const Oddity oddity : {Oddity::damping_in_time, Oddity::damping_with_speed}) {
    const Machine m = draw_machine(oddity, 121).machine;
    const RotorIdentification r = found_in(oddity, 121, 40);
    EXPECT_FALSE(r.added.empty()) << to_string(oddity);
    EXPECT_EQ(r.model.summary.status, Status::warning);
    expect_close(r, "c", m.c);
  }
}

TEST(RotorTermsProperty, NothingIsAddedToPlainRotors) {
  for (unsigned seed = 131; seed < 143; ++seed) {
    const RotorIdentification r = found_in(Oddity::none, seed, 20);
    EXPECT_TRUE(r.added.empty()) << seed << " " << r.added.front();
  }
}

// The model with its terms predicts another run, by its parameters as they are saved.
TEST(RotorTermsProperty, AModelWithTermsPredictsAnotherRun) {
  const DrawnMachine d = draw_machine(Oddity::quadratic_damping, 151);
  const Identification id = identify(machine_record(d, 40, 151));
  ASSERT_TRUE(id.usable());
  DrawnMachine other = d;
  other.run.from_hz = 28;
  other.run.seconds = 9;
  ValidateOptions options;
  const ValidationReport report = validate(id.model, std::vector<Recording>{machine_record(other, 40, 152)}, options);
  EXPECT_NE(report.summary.status, Status::unusable);
  EXPECT_LT(report.runs[0].rotor->nrmse, 0.02);
}

// A model that misses a run by more than its band fails, whatever the error in per cent.
TEST(ValidateBandProperty, AnotherUnbalanceIsOutsideTheBand) {
  const DrawnMachine d = draw_machine(Oddity::none, 161);
  const Identification id = identify(machine_record(d, 20, 161));
  const ValidationReport same = validate(id.model, std::vector<Recording>{machine_record(d, 20, 162)});
  EXPECT_NE(same.summary.status, Status::unusable) << same.summary.warnings.front();
  DrawnMachine loaded = d;
  loaded.machine.e *= 1.6;
  const ValidationReport wrong = validate(id.model, std::vector<Recording>{machine_record(loaded, 20, 163)});
  EXPECT_EQ(wrong.summary.status, Status::unusable);
  EXPECT_THAT(wrong.summary.warnings, Contains(HasSubstr("does not predict this run")));
}

}  // namespace
}  // namespace whirl::identification
