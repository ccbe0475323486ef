#include "whirl/io/settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using whirl::testing::error_of;

constexpr std::string_view kText = R"(
title = "a rig"
[rotor]
mass_gram = 1500
speed_rpm = 60
ratio = 0.7          # no unit needed
bits = 16
[laser]
on = true
axis = "x"
range_mm = [1, 2.5]
[[fault]]
start_ms = 5
[[fault]]
start_s = 2
)";

TEST(Settings, NumbersComeInSi) {
  const Settings s = parse_settings(kText, "rig.toml");
  EXPECT_EQ(s.number("rotor.mass", Quantity::mass, 0), 1.5);
  EXPECT_DOUBLE_EQ(s.number("rotor.speed", Quantity::angular_velocity, 0), 2 * std::numbers::pi);
  EXPECT_EQ(s.number("rotor.ratio", Quantity::dimensionless, 0), 0.7);
  EXPECT_EQ(s.number("rotor.absent", Quantity::mass, 7), 7);
  EXPECT_EQ(s.integer("rotor.bits", 0), 16);
  EXPECT_TRUE(s.flag("laser.on", false));
  EXPECT_EQ(s.text("laser.axis", "y", {"x", "y"}), "x");
  EXPECT_EQ(s.text("title", ""), "a rig");
  EXPECT_EQ(s.numbers("laser.range", Quantity::displacement, {}), (std::vector<double>{1e-3, 2.5e-3}));
  ASSERT_EQ(s.count("fault"), 2u);
  EXPECT_EQ(s.require_number("fault[0].start", Quantity::time), 5e-3);
  EXPECT_EQ(s.require_number("fault[1].start", Quantity::time), 2);
  EXPECT_NO_THROW(s.finish());
}

TEST(Settings, AnUnknownKeyNearToNoneIsAnsweredWithTheKeysOfItsTable) {
  const Settings s = parse_settings("[rotor]\nzzzzzzzz = 1\n", "rig.toml");
  s.number("rotor.mass", Quantity::mass, 0);
  s.number("rotor.speed", Quantity::angular_velocity, 0);
  s.number("laser.range", Quantity::displacement, 0);
  const std::string said = error_of([&] { s.finish(); });
  EXPECT_THAT(said,
              AllOf(HasSubstr("unknown key 'rotor.zzzzzzzz'; known here: "), HasSubstr("mass"), HasSubstr("speed")));
  EXPECT_THAT(said, ::testing::Not(HasSubstr("range")));
}

TEST(Settings, EveryRefusalNamesFileLineKeyAndWhatIsAllowed) {
  const Settings s = parse_settings(kText, "rig.toml");
  EXPECT_THAT(error_of([&] { s.number("rotor.mass", Quantity::mass, 0, 0, 1); }),
              AllOf(HasSubstr("rig.toml:4: rotor.mass_gram = 1500: must be between 0 and 1000 gram")));
  EXPECT_THAT(error_of([&] { s.number("rotor.mass", Quantity::force, 0); }),
              HasSubstr("must be a force; allowed units: N mN"));
  EXPECT_THAT(error_of([&] { s.number("rotor.ratio", Quantity::time, 0); }), HasSubstr("has no unit; write ratio_s"));
  EXPECT_THAT(error_of([&] { s.integer("rotor.ratio", 0); }),
              HasSubstr("rig.toml:6: rotor.ratio = 0.7: is a number, must be a whole number"));
  EXPECT_THAT(error_of([&] { s.integer("rotor.bits", 0, 1, 8); }), HasSubstr("must be between 1 and 8"));
  EXPECT_THAT(error_of([&] {
                s.text("laser.axis", "", {"a", "b"});
              }),
              HasSubstr("laser.axis = 'x': must be one of a, b"));
  EXPECT_THAT(error_of([&] { s.require_number("rotor.stiffness", Quantity::stiffness); }),
              HasSubstr("no key 'rotor.stiffness_N_m'"));
  EXPECT_THAT(error_of([] { parse_settings("a_s = 1\na_ms = 2", "b.toml").number("a", Quantity::time, 0); }),
              HasSubstr("b.toml:2: a_ms = 2: is given twice, see line 1"));
  EXPECT_THAT(error_of([] { parse_settings("a = \n", "b.toml"); }), HasSubstr("b.toml:1: damaged TOML"));
  EXPECT_THAT(error_of([] { parse_settings("a = nan", "b.toml"); }), HasSubstr("must be finite"));
  EXPECT_THAT(error_of([] { parse_settings("a = 2020-01-01", "b.toml"); }),
              HasSubstr("b.toml:1: a = 2020-01-01: must be"));
  EXPECT_THAT(error_of([] { parse_settings("a = [1, \"x\"]", "b.toml"); }), HasSubstr("array of numbers or"));
}

// A number without a dimension has no suffix and no unit, in messages neither.
TEST(Settings, MessagesOfPlainNumbersNameNoUnit) {
  const Settings s = parse_settings("E = -2.0\n", "r.toml");
  EXPECT_THAT(error_of([&] { (void)s.require_number("E", Quantity::dimensionless, 1, 9); }),
              AllOf(HasSubstr("r.toml:1: E = -2"), ::testing::EndsWith("between 1 and 9")));
  EXPECT_THAT(error_of([&] { (void)s.require_number("m.rho", Quantity::dimensionless); }),
              ::testing::EndsWith("no key 'm.rho'"));
}

TEST(Settings, UnknownKeysAreRefusedWithTheNearestName) {
  const Settings s = parse_settings("[rotor]\nmass_kg = 1\nspeeed_rpm = 3\n", "rig.toml");
  s.number("rotor.mass", Quantity::mass, 0);
  s.number("rotor.speed", Quantity::angular_velocity, 0);
  EXPECT_EQ(error_of([&] { s.finish(); }),
            "rig.toml:3: unknown key 'rotor.speeed_rpm'; did you mean 'rotor.speed_rad_s'?");
  EXPECT_THAT(error_of([] { parse_settings("[engine]\nfuel = 1\n", "rig.toml").finish(); }),
              HasSubstr("there is no table [engine]"));
}

struct Machine {
  double mass = 1, ripple = 2, runout = 0;
  int bits = 8;
  bool on = false;
};
template <class Parameters, class Visitor>
void visit_fields(Parameters& p, Visitor&& visit) {
  visit("rotor.mass_g", p.mass, 1e-3);
  visit("rotor.ripple_hz", p.ripple, 2 * std::numbers::pi);  // field in rad/s
  visit("laser.1.runout_um", p.runout, 1e-6);
  visit("laser.bits", p.bits, 1.0);
  visit("laser.on", p.on, 1.0);
}

TEST(Settings, ApplyFillsVisitedFieldsInAnyUnitOfTheQuantity) {
  Machine m;
  const Settings s = parse_settings(
      "[rotor]\nmass_g = 5\nripple_rpm = 60\n[laser]\nbits = 16\non = true\n[laser.1]\nrunout_mm = 0.02\n", "rig.toml");
  apply(s, m);
  s.finish();
  EXPECT_DOUBLE_EQ(m.mass, 5e-3);
  EXPECT_DOUBLE_EQ(m.ripple, 2 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(m.runout, 20e-6);
  double runout = 0;
  EXPECT_TRUE(s.assign("laser.1", "runout_um", runout));
  EXPECT_DOUBLE_EQ(runout, 20e-6);
  EXPECT_EQ(m.bits, 16);
  EXPECT_TRUE(m.on);
  EXPECT_THAT(error_of([&] { apply(parse_settings("laser.bits = 5000000000", "a.toml"), m); }),
              HasSubstr("laser.bits = 5000000000: must be between -2147483648 and 2147483647"));
  EXPECT_THAT(error_of([&] { apply(parse_settings("rotor.mass_mm = 1", "a.toml"), m); }), HasSubstr("must be a mass"));
}

TEST(Settings, WrittenTomlReadsBack) {
  const std::string text = to_toml({{"rotor", "mass_kg", 1.5, "of the disk"},
                                    {"", "name", std::string("a \"rig\"\n"), ""},
                                    {"laser", "bits", 16L, ""},
                                    {"rotor", "speed_rad_s", 5.0, ""},
                                    {"rotor", "third_1", 1 / 3.0, ""},
                                    {"laser", "on", false, ""},
                                    {"laser", "range_m", std::vector<double>{1e-300, 2}, ""}});
  EXPECT_THAT(text, HasSubstr("\n[rotor]\nmass_kg = 1.5  # of the disk\nspeed_rad_s = 5.0\n"));
  const Settings s = parse_settings(text, "out.toml");
  EXPECT_EQ(s.text("name", ""), "a \"rig\"\n");
  EXPECT_EQ(s.number("rotor.third", Quantity::dimensionless, 0), 1 / 3.0);
  EXPECT_EQ(s.numbers("laser.range", Quantity::displacement, {}), (std::vector<double>{1e-300, 2}));
  EXPECT_THROW(to_toml({{"a", "b c", 1.0, ""}}), Error);
}

TEST(Settings, KeysOfATableComeInTheOrderOfTheFile) {
  const Settings s = parse_settings("[names]\n\"x'\" = \"X2\"\nb = \"X5\"\na = \"X1\"\n[other]\nc = 1\n", "s.toml");
  EXPECT_EQ(s.keys("names"), (std::vector<std::string>{"x'", "b", "a"}));
  EXPECT_TRUE(s.keys("none").empty());
}

}  // namespace
}  // namespace whirl::io
