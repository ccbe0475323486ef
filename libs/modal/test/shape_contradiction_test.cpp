// Slips between sensor and file: the poles stay right, the shapes do not.
#include <gtest/gtest.h>

#include "whirl/modal/checks.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/testing/roving.hpp"

namespace {

using whirl::testing::make_roving;

std::string said_of(const whirl::FrequencyResponse& frf) {
  std::string text;
  for (const std::string& one : whirl::modal::contradicting_channels(whirl::modal::fit_modes(frf))) text += one + "\n";
  return text;
}

bool names(const std::string& text, const std::string& what) { return text.find(what) != std::string::npos; }

// Channels: p0..p3 under h0, then under h1, h2. Three references tell which FRF it is.
TEST(ShapeContradictionProperty, ASlipOfOneFrfIsNamed) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto sound = make_roving({.responses = 4, .references = 3, .seed = 900 + seed});
    auto frf = sound.frf;
    frf.channels[6].value *= -1;
    EXPECT_TRUE(names(said_of(frf), "looks as if p2/h1 is reversed\n")) << said_of(frf);
    frf = sound.frf;
    frf.channels[1].value /= 9.80665;
    EXPECT_TRUE(names(said_of(frf), "looks as if p1/h0 is in g\n")) << said_of(frf);
    frf = sound.frf;
    std::swap(frf.channels[8].value, frf.channels[11].value);
    EXPECT_TRUE(names(said_of(frf), "p0/h2 and p3/h2 are exchanged")) << said_of(frf);
  }
}

TEST(ShapeContradiction, WithTwoReferencesBothAreNamed) {
  auto frf = make_roving({.seed = 911}).frf;
  frf.channels[2].value *= -1;
  const std::string text = said_of(frf);
  EXPECT_TRUE(names(text, "p2/h0 is reversed") && names(text, "p2/h1 is reversed")) << text;
}

TEST(ShapeContradiction, AMisnamedReferenceIsSaid) {
  auto frf = make_roving({.seed = 912}).frf;
  for (auto& channel : frf.channels) channel.reference = "h0";
  EXPECT_TRUE(names(said_of(frf), "more than once"));
}

// Gains some percent off, other frequencies under one reference, roving, noise: no slip.
TEST(ShapeContradictionProperty, SoundSetsAreNotAccused) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    EXPECT_EQ(said_of(make_roving({.references = 3, .noise = 0.02, .seed = 920 + seed}).frf), "");
    EXPECT_EQ(said_of(make_roving({.frequency_scatter = 3e-4, .seed = 930 + seed}).frf), "");
    EXPECT_EQ(said_of(make_roving({.reference_shift = -5e-4, .seed = 940 + seed}).frf), "");
    auto frf = make_roving({.seed = 950 + seed}).frf;
    for (auto& channel : frf.channels) channel.value *= 1 + 0.03 * normal(random);
    EXPECT_EQ(said_of(frf), "");
  }
}

}  // namespace
