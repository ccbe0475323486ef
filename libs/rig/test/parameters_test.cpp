#include "whirl/rig/parameters.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <type_traits>

#include "whirl/core/error.hpp"
#include "whirl/rig/fields.hpp"
#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {
namespace {

TEST(RigParameters, EccentricityAddsTheMassToTheResidual) {
  const RigParameters p;
  const double added = 5e-3 * 82.73e-3 / 1.5;
  EXPECT_NEAR(std::abs(p.eccentricity() - (std::polar(51.3e-6, 0.6) + added)), 0, 1e-12);
  EXPECT_NEAR(p.natural_frequency(), 75.277, 1e-3);
  EXPECT_NEAR(p.true_model().damping_ratio(), 0.0066, 1e-4);
}

TEST(RigParameters, EveryFieldIsVisitedOnceWithItsUnit) {
  RigParameters p;
  std::map<std::string, double> found;
  visit_fields(p, [&](std::string_view key, auto& field, double unit) {
    const bool fresh = found.emplace(key, static_cast<double>(field) / unit).second;
    EXPECT_TRUE(fresh) << key;
  });
  EXPECT_NEAR(found.at("rotor.mass_kg"), 1.5, 1e-12);
  EXPECT_NEAR(found.at("laser.noise_um"), 0.7, 1e-12);
  EXPECT_NEAR(found.at("actuator.axis_rotation_deg"), 2, 1e-12);
  EXPECT_NEAR(found.at("profile.start_rpm"), 1797, 1);
  EXPECT_NEAR(found.at("profile.ripple_frequency_rpm"), 42, 1e-9);
  EXPECT_NEAR(found.at("modes.2.frequency_hz"), 128, 1e-12);
  EXPECT_EQ(found.at("laser.bits"), 16);
  // 12 rotor, 9 profile, 3 x 6 modes, 11 laser, 13 actuator, 3 encoder, 2 timing, 7 tilt, 17 further forces.
  EXPECT_EQ(found.size(), 94u);
}

TEST(RigParametersProperty, WritingBackAllFieldsRestoresTheRig) {
  RigParameters p;
  std::map<std::string, double> values;
  visit_fields(p, [&](std::string_view key, auto& field, double unit) {
    values[std::string(key)] = static_cast<double>(field) / unit;
  });
  RigParameters other = RigParameters::ideal_rotor_b();
  other.modes.resize(p.modes.size());
  visit_fields(other, [&](std::string_view key, auto& field, double unit) {
    field = static_cast<std::remove_reference_t<decltype(field)>>(values.at(std::string(key)) * unit);
  });
  VirtualRig a(p), b(other);
  for (int i = 0; i < 1000; ++i) {
    ASSERT_NEAR(a.read().x, b.read().x, 1e-12);
    a.advance();
    b.advance();
  }
}

TEST(RigParametersProperty, ReadsConstParameters) {
  const RigParameters p;
  int count = 0;
  visit_fields(p, [&](std::string_view, const auto&, double) { ++count; });
  EXPECT_EQ(count, 94);
}

TEST(RigParameters, ACurrentLimitWithoutForceConstantIsAnError) {
  RigParameters p;
  p.actuator.current_limit = 2;
  EXPECT_THROW(p.check(), Error);
  p.actuator.force_per_ampere = 3;
  EXPECT_NO_THROW(p.check());
  EXPECT_DOUBLE_EQ(p.actuator.force_limit(), std::min(6.0, p.actuator.voltage_limit * p.actuator.force_per_volt));
}

TEST(RigParameters, ImpossibleSensorGridIsAnError) {
  RigParameters p;
  p.timing.substeps = 10;  // 0.1 ms steps miss the 4 kHz instants
  EXPECT_THROW(p.check(), Error);
  p.timing.substeps = 20;
  EXPECT_NO_THROW(p.check());
  p.rotor.mass = 0;
  try {
    p.check();
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("rotor.mass"), std::string::npos);
  }
}

TEST(RigParameters, RunUpReversesTheProfile) {
  const RigParameters p = RigParameters{}.run_up();
  EXPECT_EQ(p.profile.omega_start, 0);
  EXPECT_NEAR(p.profile.omega_end, 188.19, 0.01);
  EXPECT_EQ(p.profile.dwell_start, 1);
  EXPECT_EQ(p.profile.dwell_end, 0);
}

}  // namespace
}  // namespace whirl::rig
