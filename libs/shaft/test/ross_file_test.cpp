// Rotors as ROSS saves them, against frequencies that its documentation prints and against the same rotor written here.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/testing/compiled.hpp"

namespace whirl::shaft {
namespace {

ImportedRotor imported(const std::string& text) {
  const whirl::testing::TemporaryFolder folder;
  folder.write("rotor.toml", text);
  return import_ross_rotor(folder.path() / "rotor.toml");
}

std::string layer(int number, int n, double length, double inner, double outer, const std::string& more = "",
                  double modulus = 2.11e11) {
  return fmt::format(
      "[\"ShaftElement_Shaft Element {0}\"]\nL = {2}\nidl = {3}\nodl = {4}\nidr = {3}\nodr = {4}\nn = {1}\n"
      "axial_force = 0\ntorque = 0\nshear_effects = true\nrotary_inertia = true\ngyroscopic = true\n"
      "shear_method_calc = \"cowper\"\ntag = \"Shaft Element {0}\"\n{5}\n"
      "[\"ShaftElement_Shaft Element {0}\".material]\nname = \"Steel\"\nrho = 7810.0\nE = {6}\nG_s = 8.12e10\n"
      "color = \"#525252\"\n",
      number, n, length, inner, outer, more, modulus);
}
std::string disc(int number, int n, const Disc& d) {
  return fmt::format(
      "[\"DiskElement_Disk {0}\"]\nn = {1}\nm = {2}\nId = {3}\nIp = {4}\ntag = \"Disk {0}\"\nscale_factor = 1.0\n"
      "color = \"Firebrick\"\n",
      number, n, d.mass, d.transverse, d.polar);
}
std::string bearing(int number, int n, double kxx, double kyy, const std::string& more = "") {
  return fmt::format(
      "[\"BearingElement_Brg. {0}\"]\nn = {1}\nkxx = [ {2},]\nkyy = [ {3},]\nkxy = [ 0,]\nkyx = [ 0,]\ncxx = [ 0,]\n"
      "cyy = [ 0,]\nkzz = [ 0,]\ntag = \"Brg. {0}\"\n{4}\n",
      number, n, kxx, kyy, more);
}
/// Friswell and others, example 5.9.1: a shaft of 1.5 m in six elements, two discs, bearings at the ends.
std::string two_discs(double kyy, bool layers = false) {
  std::string text = "ross_version = \"2.3.0\"\n[parameters]\n";
  for (int k = 0; k < 6; ++k) {
    if (layers) text += layer(10 + k, k, 0.25, 0.03, 0.05);
    text += layer(k, k, 0.25, 0, layers ? 0.03 : 0.05);
  }
  text += disc(0, 2, cylinder(7810, 0.28, 0.05, 0.07)) + disc(1, 4, cylinder(7810, 0.35, 0.05, 0.07));
  return text + bearing(0, 0, 1e6, kyy) + bearing(1, 6, 1e6, kyy);
}
std::vector<double> frequencies(const Rotor& rotor, double rpm) {
  std::vector<double> list;
  for (const Mode& m : modes(assemble(rotor), rpm * M_PI / 30, 6)) list.push_back(m.frequency());
  std::sort(list.begin(), list.end());
  return list;
}
void expect_frequencies(const Rotor& rotor, double rpm, const std::vector<double>& printed, double part) {
  const std::vector<double> found = frequencies(rotor, rpm);
  ASSERT_EQ(found.size(), printed.size());
  for (std::size_t k = 0; k < found.size(); ++k) EXPECT_NEAR(found[k] / printed[k], 1, part) << k;
}

// rad/s, docs/examples of ROSS, examples 5.9.1 and 5.9.2.
TEST(RossFileReference, FrequenciesAreThoseThatRossPrints) {
  const ImportedRotor equal = imported(two_discs(1e6)), unequal = imported(two_discs(0.8e6));
  EXPECT_TRUE(equal.remarks.empty());
  EXPECT_EQ(equal.rotor.sections.size(), 1u);
  expect_frequencies(equal.rotor, 4000, {85.38947, 87.79586, 251.78460, 294.71333, 600.17936, 827.07536}, 1e-7);
  expect_frequencies(unequal.rotor, 4000, {82.32547, 86.86370, 239.64228, 287.24958, 583.48783, 806.88728}, 1e-7);
  // It is a rotor file like any other.
  const Rotor again = parse_rotor(rotor_text(equal.rotor), "again");
  expect_frequencies(again, 4000, frequencies(equal.rotor, 4000), 1e-12);
}

TEST(RossFileReference, LayersThatTouchAreOneSection) {
  const ImportedRotor layers = imported(two_discs(1e6, true));
  EXPECT_EQ(layers.remarks.size(), 1u);
  expect_frequencies(layers.rotor, 4000, frequencies(imported(two_discs(1e6)).rotor, 4000), 1e-12);
  std::string text = two_discs(1e6) + layer(20, 3, 0.25, 0.06, 0.08);
  EXPECT_THROW(imported(text), Error) << "a gap between the layers";
  text = two_discs(1e6) + layer(20, 3, 0.25, 0.05, 0.08, "", 2e11);
  EXPECT_THROW(imported(text), Error) << "another material";
}

// Sleeves without stiffness: the frequencies of the shaft fall as by discs of their mass.
TEST(RossFileReference, SleevesWithoutStiffnessAreDiscsOfTheirMass) {
  const ImportedRotor found = imported(two_discs(1e6) + layer(20, 3, 0.25, 0.05, 0.2, "", 6894.75));
  EXPECT_EQ(found.remarks.size(), 1u);
  Rotor expected = imported(two_discs(1e6)).rotor;
  Disc sleeve = cylinder(7810, 0.2, 0.05, 0.25);
  sleeve.position = 0.875;
  expected.discs.push_back(sleeve);
  expect_frequencies(found.rotor, 4000, frequencies(expected, 4000), 1e-9);
  EXPECT_LT(frequencies(found.rotor, 0)[0], 0.8 * frequencies(imported(two_discs(1e6)).rotor, 0)[0]);
}

// A mass of 3 kg between bearing and ground; the file names the mount first.
TEST(RossFileReference, MassesBetweenBearingAndGroundAreBodies) {
  std::string text = two_discs(1e6);
  text.replace(text.find("[\"BearingElement_Brg. 1\"]"), std::string::npos, "");
  text += bearing(2, 7, 5e6, 5e6) + bearing(1, 6, 1e6, 1e6, "n_link = 7") +
          "[\"PointMass_Housing\"]\nn = 7\nm = 3\ntag = \"Housing\"\n";
  const Rotor rotor = imported(text).rotor;
  Rotor expected = imported(two_discs(1e6)).rotor;
  expected.bodies = {{"Housing", 1.5, 3, 0}};
  expected.supports[1].b = {"Housing", 1.5};
  Support mount = expected.supports[1];
  mount.a = {"Housing", 1.5}, mount.b = {"ground", 1.5};
  mount.law.stiffness = {5e6 * Eigen::Matrix2d::Identity()};
  expected.supports.push_back(mount);
  expect_frequencies(rotor, 3000, frequencies(expected, 3000), 1e-12);
  EXPECT_THROW(imported(two_discs(1e6) + "[\"PointMass_Housing\"]\nn = 7\nm = 3\n"), Error) << "nothing holds it";
}

TEST(RossFileReference, TablesOverSpeedKeepTheirValues) {
  std::string text = two_discs(1e6);
  text +=
      "[SealElement_seal]\nn = 3\nkxx = [1e4, 3e4]\nkxy = [5, 6]\nkyx = [-5, -6]\nkyy = [1e4, 3e4]\n"
      "cxx = [10, 20]\ncyy = [10, 20]\nfrequency = [100.0, 500.0]\nkzz = [1, 1]\n";
  const ImportedRotor found = imported(text);
  EXPECT_EQ(found.remarks.size(), 2u) << "axial coefficients, and how tables are read between their speeds";
  const SupportLaw& law = found.rotor.supports.back().law;
  EXPECT_EQ(law.speeds, (std::vector<double>{100, 500}));
  EXPECT_EQ(law.at(300).stiffness(0, 0), 2e4);
  EXPECT_EQ(law.at(500).stiffness(0, 1), 6);
  EXPECT_EQ(law.at(500).stiffness(1, 0), -6);
  EXPECT_EQ(law.at(100).damping(1, 1), 10);
}

// What a rotor file cannot hold is named with its place; nothing of it is lost.
TEST(RossFileReference, WhatCannotBeHeldIsRefusedByName) {
  const std::string sound = two_discs(1e6);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const std::pair<std::string, const char*> cases[] = {
      {changed("torque = 0", "torque = 5"), "torque"},
      {changed("gyroscopic = true", "gyroscopic = false"), "gyroscopic"},
      {changed("axial_force = 0", "axial_force = 9"), "axial_force"},
      {changed("tag = \"Shaft Element 0\"", "tag = \"Shaft Element 0\"\nbeta = 1e-5"), "beta"},
      {changed("tag = \"Shaft Element 0\"", "tag = \"Shaft Element 0\"\nnotch = 2"), "notch"},
      {changed("n = 3\naxial", "n = 9\naxial"), "number 3"},
      {changed("kyy = [ 1000000,]", "kyy = [ 1, 2,]"), "kyy"},
      {changed("E = 211000000000", "E = \"hard\""), "must be a number"},
      {sound + "[\"GearElement_g\"]\nn = 2\nm = 3\n", "GearElement"},
      {sound + bearing(5, 3, 1, 1, "n_link = 40"), "n_link"},
      {sound + bearing(5, 3, 1, 1, "n_link = 3"), "another node"},
      {changed("kyy = [ 1000000,]\n", ""), "kyy"},
      {sound + "[PointMass_a]\nn = 9\nm = 1\n[PointMass_b]\nn = 9\nm = 2\n", "another PointMass"},
      {"[rotor]\nname = \"whirl\"\n", "rotor"},
      {"", "ShaftElement"}};
  for (const auto& [text, word] : cases) try {
      imported(text);
      ADD_FAILURE() << word;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("rotor.toml"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace whirl::shaft
