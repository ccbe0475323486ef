// Rotors found from what velocity pickups and accelerometers with a high-pass read: the map from the model to the
// reading, no integral.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/records/rotor_sensors.hpp"

namespace whirl::identification {
namespace {

using namespace testing;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;

SensedRotor drawn(Quantity quantity, unsigned long long seed) {
  std::mt19937_64 random(seed);
  return drawn_rotor(quantity, random);
}

RotorIdentification found_from(const Recording& record) {
  return identify_rotor_detailed(std::vector<Recording>{record});
}

class SensedRates : public ::testing::TestWithParam<Quantity> {};
INSTANTIATE_TEST_SUITE_P(Of, SensedRates, ::testing::Values(Quantity::velocity, Quantity::acceleration),
                         [](const auto& p) { return std::string(to_string(p.param)); });

// Seeds apart from those that any number was chosen on.
TEST_P(SensedRates, TheRotorIsFoundAndTheIntervalsCover) {
  int covered = 0, intervals = 0;
  for (unsigned long long seed = 7001; seed < 7011; ++seed) {
    SCOPED_TRACE(seed);
    const SensedRotor truth = drawn(GetParam(), seed);
    const IdentifiedModel m = found_from(sensed_record(truth, seed)).model;
    ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
    EXPECT_EQ(m.quantity, GetParam());
    EXPECT_LT(m.summary.chi_square, 1.3);
    for (const auto& [name, value] : {std::pair("k1", truth.k1), std::pair("c", truth.c), std::pair("k2", truth.k2),
                                      std::pair("e", truth.e), std::pair("e_phase", truth.phase)}) {
      const Estimate& e = *m.parameter(name);
      const double error =
          std::string(name) == "e_phase" ? std::remainder(e.value - value, 2 * std::numbers::pi) : e.value - value;
      EXPECT_LT(std::abs(error), 4.5 * e.sd) << name;
      covered += e.value - error >= e.low && e.value - error <= e.high;
      ++intervals;
    }
    EXPECT_NEAR(m.parameter("k1")->value / truth.k1, 1, 2e-3);
    EXPECT_NEAR(m.parameter("c")->value / truth.c, 1, 0.03);
  }
  EXPECT_GT(covered, 0.88 * intervals);  // 95 % intervals: 44 of 50 or fewer have a chance of 4 %
}

// A sensor's corner within reach of the speeds is among the parameters.
TEST_P(SensedRates, TheHighPassOfTheSensorsIsFound) {
  SensedRotor truth = drawn(GetParam(), 7021);
  truth.corner = 2;
  truth.noise_db = 40;
  const IdentifiedModel m = found_from(sensed_record(truth, 1)).model;
  const Estimate* corner = m.parameter("sensor_high_pass");
  ASSERT_NE(corner, nullptr);
  EXPECT_NEAR(corner->value / (2 * std::numbers::pi), 2, 0.1);
  EXPECT_EQ(m.parameter("offset_x"), nullptr);
  EXPECT_NE(m.parameter(std::string("offset_") + std::string(to_string(GetParam())) + "_x"), nullptr);
  EXPECT_EQ(m.rotor->offset, 0.0);  // where the rotor rests no such sensor shows
}

// What the growth test on free runs is for: springs that differ, and a gain of one sensor.
TEST_P(SensedRates, TermsBeyondThePlainRotorAreFound) {
  SensedRotor truth = drawn(GetParam(), 7031);
  truth.difference = 0.02;
  truth.gain_y = 1.03;
  truth.noise_db = 40;
  const RotorIdentification found = found_from(sensed_record(truth, 1));
  EXPECT_THAT(found.added, Contains(HasSubstr("anisotropic stiffness")));
  ASSERT_NE(found.model.parameter("k1_conj_re"), nullptr);
  EXPECT_NEAR(found.model.parameter("k1_conj_re")->value / (0.01 * truth.k1), 1, 0.1);
  ASSERT_NE(found.model.parameter("sensor_gain"), nullptr);
  EXPECT_NEAR(found.model.parameter("sensor_gain")->value, 0.03, 5e-3);
  EXPECT_LT(found.model.summary.chi_square, 1.3);
}

// One direction alone, as one sensor on a housing has it.
TEST_P(SensedRates, OneDirectionWillDo) {
  const SensedRotor truth = drawn(GetParam(), 7041);
  Recording record = sensed_record(truth, 1);
  std::erase_if(record.channels, [](const Channel& c) { return c.name == "y"; });
  const IdentifiedModel m = found_from(record).model;
  ASSERT_NE(m.summary.status, Status::unusable) << m.summary.warnings.back();
  EXPECT_LT(std::abs(m.parameter("k1")->value - truth.k1), 4.5 * m.parameter("k1")->sd);
  EXPECT_NEAR(m.parameter("k1")->value / truth.k1, 1, 5e-3);
}

// The start of the unseen direction's high-pass is no parameter: with it the equations were singular.
TEST(OneAxis, ADisplacementWithACCouplingInOneDirectionWillDo) {
  for (const unsigned seed : {7042u, 7043u}) {
    SensedRotor truth = drawn(Quantity::displacement, seed);
    truth.corner = 1.2;
    truth.noise_db = 35;
    for (const char* unseen : {"x", "y"}) {
      Recording record = sensed_record(truth, 1);
      std::erase_if(record.channels, [&](const Channel& c) { return c.name == unseen; });
      const IdentifiedModel m = found_from(record).model;
      ASSERT_NE(m.summary.status, Status::unusable) << seed << unseen << m.summary.warnings.back();
      ASSERT_NE(m.parameter("sensor_high_pass"), nullptr) << seed << unseen;
      EXPECT_NEAR(m.parameter("sensor_high_pass")->value / (2 * std::numbers::pi), 1.2, 0.12) << seed << unseen;
      EXPECT_NEAR(m.parameter("k1")->value / truth.k1, 1, 5e-3) << seed << unseen;
    }
  }
}

// Errors of a free run have the unit of the reading, and the model predicts what sensors of another quantity read.
TEST_P(SensedRates, AModelIsValidatedInTheUnitOfEachRecord) {
  SensedRotor truth = drawn(GetParam(), 7051);
  const Identification id = identify(sensed_record(truth, 1));
  ASSERT_TRUE(id.usable());
  EXPECT_EQ(id.evidence.held_out.unit, si_unit(GetParam())) << id.evidence.held_out.reason;
  ASSERT_EQ(id.evidence.held_out.scores.size(), 2U);
  const IdentifiedModel read = io::from_json<IdentifiedModel>(io::to_json(id.model), "model");
  EXPECT_EQ(read.quantity, GetParam());
  EXPECT_EQ(read.noise_sd, id.model.noise_sd);
  for (const Quantity other : {Quantity::displacement, Quantity::velocity, Quantity::acceleration}) {
    truth.quantity = other;
    if (other != GetParam()) truth.corner = 0;
    const Validation v = validate_model(read, sensed_record(truth, 2));
    EXPECT_EQ(v.quantity, other);
    EXPECT_EQ(v.simulated.at("x").quantity, other);
    EXPECT_LT(v.rmse_x, 1.1 * v.noise_x) << to_string(other);
    EXPECT_LT(v.rmse_y, 1.1 * v.noise_y) << to_string(other);
    truth.corner = drawn(GetParam(), 7051).corner;
  }
}

TEST(SensedRatesRefused, WhatCannotBeUsedIsNamed) {
  const Recording record = sensed_record(drawn(Quantity::acceleration, 7061), 1);
  Recording mixed = record;
  mixed.channels[0].quantity = Quantity::displacement;
  const auto said = [](auto&& call) {
    try {
      call();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(said([&] { (void)found_from(mixed); }), AllOf(HasSubstr("channel y"), HasSubstr("acceleration")));
  EXPECT_THAT(said([&] { (void)identify_paper(record, {}); }), HasSubstr("acceleration"));
  EXPECT_THAT(said([&] { (void)rotor_record(record); }), HasSubstr("displacement of the shaft"));
  Recording slower = record;
  for (Channel& c : slower.channels)
    if (c.quantity == Quantity::acceleration) c.quantity = Quantity::velocity;
  EXPECT_THAT(said([&] { (void)identify_rotor({record, slower}); }), HasSubstr("one quantity"));
  RotorIdentifyOptions assumed;
  assumed.angle_source = AngleSource::profile;
  EXPECT_THAT(said([&] { (void)identify_rotor(record, assumed); }), HasSubstr("measure the angle"));
}

}  // namespace
}  // namespace whirl::identification
