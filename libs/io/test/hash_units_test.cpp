#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
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

TEST(HashProperty, PiecesGiveTheHashOfTheWhole) {
  const std::string text(1000, 'q');
  for (std::size_t piece : {1u, 7u, 55u, 56u, 63u, 64u, 65u, 500u}) {
    Sha256 h;
    for (std::size_t i = 0; i < text.size(); i += piece) h.update(std::string_view(text).substr(i, piece));
    EXPECT_EQ(h.hex(), sha256(text)) << piece;
  }
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

TEST(UnitsProperty, EveryUnitInvertsAndEveryQuantityHasASiSuffix) {
  std::set<Quantity> seen;
  for (const UnitSuffix& u : all_units()) {
    EXPECT_NEAR(u.from_si(u.to_si(0.37)), 0.37, 1e-12) << u.suffix;
    const UnitSuffix& si = si_suffix(u.quantity);
    EXPECT_EQ(si.to_si(0.37), 0.37) << u.suffix;
    seen.insert(u.quantity);
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(Quantity::force_constant) + 1);
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
