#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <set>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/units.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::io {
namespace {

// NIST example values of FIPS 180-4 (one block, two blocks, a million letters) and the empty message.
TEST(HashReference, Sha256OfTheNistExamples) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(HashProperty, AFileReadInPiecesHasTheHashOfItsBytes) {
  const auto file = std::filesystem::temp_directory_path() / "whirl_hash_pieces.bin";
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{1} << 18, (std::size_t{1} << 18) + 1, std::size_t{700001}}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 2654435761u >> 13);
    std::ofstream(file, std::ios::binary) << bytes;
    EXPECT_EQ(sha256_file(file), sha256(bytes)) << size;
  }
  std::filesystem::remove(file);
}

TEST(HashReference, OfTheSilverboxFileAsPublished) {
  const auto file = testing::data_file("silverbox/SNLS80mV.csv");
  WHIRL_REQUIRE_DATA(file);
  EXPECT_EQ(input_record(file), "SNLS80mV.csv sha256:ae62d5a91230c10f76e6dd02c8a4fac3c9d4d8a95fbf50e87cb0c4885003e0f1");
}

TEST(Units, SuffixesGiveSi) {
  const auto si = [](std::string_view suffix, double v) { return find_unit(suffix)->to_si(v); };
  EXPECT_EQ(si("mm", 6.45), 6.45e-3);
  EXPECT_DOUBLE_EQ(si("mil", 1), 25.4e-6);
  EXPECT_DOUBLE_EQ(si("rpm", 60), 2 * std::numbers::pi);
  EXPECT_EQ(si("g", 2), 19.6133);
  EXPECT_EQ(si("degC", 20), 293.15);
  EXPECT_EQ(si("dB", 40), 100);
  EXPECT_EQ(si("N_mm3", 1), 1e9);
  EXPECT_EQ(si("percent", 5), 0.05);
  EXPECT_EQ(find_unit("hz")->quantity, Quantity::frequency);
  EXPECT_EQ(find_unit("hz", Quantity::angular_velocity)->to_si(1), 2 * std::numbers::pi);
  EXPECT_EQ(find_unit("rpm", Quantity::frequency)->to_si(60), 1);
  EXPECT_EQ(find_unit("mm", Quantity::force), nullptr);
}

TEST(Units, TheLongestSuffixCounts) {
  EXPECT_EQ(split_unit("acc_m_s2").unit->suffix, "m_s2");
  EXPECT_EQ(split_unit("acc_m_s2").name, "acc");
  EXPECT_EQ(split_unit("max_speed_rad_s").unit->suffix, "rad_s");
  EXPECT_EQ(split_unit("max_speed_rad_s").name, "max_speed");
  EXPECT_EQ(split_unit("k_1_s2").unit->quantity, Quantity::rate_squared);
  EXPECT_EQ(split_unit("K1_N_m").unit->quantity, Quantity::stiffness);
  EXPECT_EQ(split_unit("torque_Nm").unit->quantity, Quantity::torque);
  EXPECT_EQ(split_unit("acc_g").unit->quantity, Quantity::acceleration);
  EXPECT_EQ(split_unit("added_mass_g").unit->quantity, Quantity::mass);
  EXPECT_EQ(split_unit("_mm").unit, nullptr);
  EXPECT_EQ(split_unit("x").unit, nullptr);
}

// The whole table: what one (for dB and degC: what 40 and 20) of each is in SI, from its definition.
TEST(Units, EveryFactorIsThatOfTheDefinition) {
  constexpr double kPi = 3.14159265358979323846;
  struct Row {
    const char* suffix;
    Quantity quantity;
    double given, si;
  };
  using Q = Quantity;
  const Row rows[] = {{"s", Q::time, 1, 1},
                      {"ms", Q::time, 1, 0.001},
                      {"us", Q::time, 1, 0.000001},
                      {"min", Q::time, 2, 120},
                      {"m", Q::displacement, 1, 1},
                      {"cm", Q::displacement, 1, 0.01},
                      {"mm", Q::displacement, 1, 0.001},
                      {"um", Q::displacement, 1, 0.000001},
                      {"nm", Q::displacement, 1, 0.000000001},
                      {"in", Q::displacement, 1, 0.0254},
                      {"mil", Q::displacement, 1, 0.0000254},
                      {"m_s", Q::velocity, 1, 1},
                      {"mm_s", Q::velocity, 1, 0.001},
                      {"in_s", Q::velocity, 1, 0.0254},
                      {"m_s2", Q::acceleration, 1, 1},
                      {"mm_s2", Q::acceleration, 1, 0.001},
                      {"g", Q::acceleration, 1, 9.80665},
                      {"N", Q::force, 1, 1},
                      {"mN", Q::force, 1, 0.001},
                      {"kN", Q::force, 1, 1000},
                      {"lbf", Q::force, 1, 0.45359237 * 9.80665},
                      {"kgf", Q::force, 1, 9.80665},
                      {"rad", Q::angle, 1, 1},
                      {"deg", Q::angle, 180, kPi},
                      {"rev", Q::angle, 1, 2 * kPi},
                      {"rad_s", Q::angular_velocity, 1, 1},
                      {"rpm", Q::angular_velocity, 60, 2 * kPi},
                      {"deg_s", Q::angular_velocity, 180, kPi},
                      {"rad_s2", Q::angular_acceleration, 1, 1},
                      {"rpm_s", Q::angular_acceleration, 60, 2 * kPi},
                      {"hz", Q::frequency, 1, 1},
                      {"Hz", Q::frequency, 1, 1},
                      {"kHz", Q::frequency, 1, 1000},
                      {"V", Q::voltage, 1, 1},
                      {"mV", Q::voltage, 1, 0.001},
                      {"A", Q::current, 1, 1},
                      {"mA", Q::current, 1, 0.001},
                      {"Pa", Q::pressure, 1, 1},
                      {"kPa", Q::pressure, 1, 1000},
                      {"MPa", Q::pressure, 1, 1000000},
                      {"bar", Q::pressure, 1, 100000},
                      {"kg", Q::mass, 1, 1},
                      {"gram", Q::mass, 1, 0.001},
                      {"K", Q::temperature, 1, 1},
                      {"degC", Q::temperature, 20, 293.15},
                      {"strain", Q::strain, 1, 1},
                      {"ustrain", Q::strain, 1, 0.000001},
                      {"1", Q::dimensionless, 1, 1},
                      {"percent", Q::dimensionless, 1, 0.01},
                      {"dB", Q::dimensionless, 40, 100},
                      {"Nm", Q::torque, 1, 1},
                      {"mNm", Q::torque, 1, 0.001},
                      {"N_m", Q::stiffness, 1, 1},
                      {"N_mm", Q::stiffness, 1, 1000},
                      {"kN_m", Q::stiffness, 1, 1000},
                      {"N_m3", Q::cubic_stiffness, 1, 1},
                      {"N_mm3", Q::cubic_stiffness, 1, 1000000000},
                      {"Ns_m", Q::damping, 1, 1},
                      {"kgm2", Q::moment_of_inertia, 1, 1},
                      {"1_s", Q::rate, 1, 1},
                      {"1_s2", Q::rate_squared, 1, 1},
                      {"N_V", Q::force_constant, 1, 1},
                      {"m2_s2", Q::specific_energy, 1, 1},
                      {"m2_s3", Q::specific_power, 1, 1},
                      {"hz", Q::angular_velocity, 1, 2 * kPi},
                      {"Hz", Q::angular_velocity, 1, 2 * kPi},
                      {"rpm", Q::frequency, 60, 1}};
  EXPECT_EQ(std::size(rows), all_units().size()) << "a unit without its row here";
  for (const Row& r : rows) {
    const UnitSuffix* unit = find_unit(r.suffix, r.quantity);
    ASSERT_NE(unit, nullptr) << r.suffix;
    EXPECT_NEAR(unit->to_si(r.given), r.si, 1e-14 * r.si) << r.suffix;
    EXPECT_NEAR(unit->from_si(r.si), r.given, 1e-12 * r.given) << r.suffix;
  }
}

TEST(Units, WhatIsAllowedIsListedOnceAndAMissingOrMisspeltUnitIsNamed) {
  EXPECT_EQ(allowed_units(Quantity::time), "s ms us min");
  EXPECT_EQ(allowed_units(Quantity::frequency), "hz Hz kHz rpm");
  const std::string all = allowed_units();
  EXPECT_EQ(all.substr(0, 12), "s ms us min ");
  EXPECT_EQ(all.substr(all.size() - 6), " m2_s3") << "a second reading is no second entry";
  EXPECT_EQ(unit_problem("x").find("'x' has no unit; write name_unit, e.g. 'x_mm'"), 0u);
  EXPECT_EQ(unit_problem("_x").find("'_x' has no unit"), 0u);
  EXPECT_EQ(unit_problem("x_MM").find("'x_MM' has the unknown unit 'MM' (did you mean 'mm'?)"), 0u);
  EXPECT_EQ(unit_problem("a_b_furlong").find("'a_b_furlong' has the unknown unit 'furlong'; allowed"), 0u);
}

TEST(Units, ANameWithoutUnitIsAnsweredWithTheUsualOne) {
  for (const auto& [name, example] :
       std::initializer_list<std::pair<const char*, const char*>>{{"t", "t_s"},
                                                                  {"beta", "beta_rad"},
                                                                  {"speed", "speed_rpm"},
                                                                  {"ux", "ux_N"},
                                                                  {"uy", "uy_N"},
                                                                  {"load", "load_N"},
                                                                  {"acc", "acc_m_s2"},
                                                                  {"accel1", "accel1_m_s2"},
                                                                  {"vy", "vy_m_s"},
                                                                  {"x", "x_mm"}}) {
    EXPECT_THAT(unit_problem(name), ::testing::HasSubstr(std::string("e.g. '") + example + "'"));
  }
}

TEST(Units, TheNearestWordIsFoundWithinHalfTheLetters) {
  const auto near = [](std::string_view word, std::vector<std::string> candidates) {
    return nearest(word, candidates);
  };
  EXPECT_EQ(near("rotr", {"stator", "rotor"}), "rotor");
  EXPECT_EQ(near("ROTOR", {"rotor"}), "rotor");
  EXPECT_EQ(near("rotor", {"ROTORS"}), "ROTORS");
  EXPECT_EQ(near("ab", {"ba"}), "ba") << "two that changed places are one mistake";
  EXPECT_EQ(near("ab", {"abc"}), "abc");
  EXPECT_EQ(near("ab", {"abcd"}), "") << "two mistakes in two letters";
  EXPECT_EQ(near("ab", {"cd"}), "");
  EXPECT_EQ(near("abcdefgh", {"abcdeXYZ"}), "abcdeXYZ") << "three in eight";
  EXPECT_EQ(near("abcdefgh", {"abcdWXYZ"}), "") << "four in eight";
  EXPECT_EQ(near("abcdefgh", {"badcfegh"}), "badcfegh") << "three pairs";
  EXPECT_EQ(near("abcd", {"abcx", "abcy"}), "abcx") << "the first of equals";
  EXPECT_EQ(near("abcd", {"abxx", "abcy"}), "abcy");
  EXPECT_EQ(near("abcdef", {"bcdef"}), "bcdef");
  EXPECT_EQ(near("bcdef", {"abcdef"}), "abcdef");
  EXPECT_EQ(near("abc", {}), "");
  EXPECT_EQ(near("aaa", {"aab"}), "aab");
  EXPECT_EQ(near("aaa", {"aabb"}), "") << "two mistakes in three letters";
  EXPECT_EQ(near("aab", {"abc"}), "") << "the last letters did not change places";
}

TEST(UnitsProperty, EveryUnitInvertsAndEveryQuantityHasASiSuffix) {
  std::set<Quantity> seen;
  for (const UnitSuffix& u : all_units()) {
    EXPECT_NEAR(u.from_si(u.to_si(0.37)), 0.37, 1e-12) << u.suffix;
    const UnitSuffix& si = si_suffix(u.quantity);
    EXPECT_EQ(si.to_si(0.37), 0.37) << u.suffix;
    EXPECT_EQ(si.quantity, u.quantity) << u.suffix;
    seen.insert(u.quantity);
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(Quantity::specific_power) + 1);
}

TEST(File, ASinkNotClosedLeavesNothing) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "sink.txt";
  std::filesystem::remove(file);
  { ByteSink(file).write("half"); }
  EXPECT_FALSE(std::filesystem::exists(file));
  write_text(file, "whole");
  EXPECT_EQ(read_text(file), "whole");
  EXPECT_THROW(read_text(file, 3), Error);
  EXPECT_THROW(write_text("/nonexistent/x", ""), Error);
}

}  // namespace
}  // namespace whirl::io
