// Good probes see every effect of a real machine at once: the search goes on while terms explain what is left.
#include "whirl/testing/systems/many_effects.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "whirl/identify/identify.hpp"

namespace whirl::identification {
namespace {

/// Kinds of forces that differ are counted, not their parts: a spring stiffer to one side has four. With six parts at
/// most chi-square stayed between 12 and 11825 for twelve such rotors, none was trusted, and c was up to 18 % off.
class ManyEffectsProperty : public ::testing::TestWithParam<unsigned> {};

TEST_P(ManyEffectsProperty, AreAllFound) {
  const testing::ManyEffects truth = testing::many_effects(GetParam(), 3);
  const testing::Machine& m = truth.drawn.machine;
  IdentifyOptions options;
  options.method = Method::weak;
  const Identification found = identify({testing::machine_record(truth.drawn, 70, GetParam())}, options);
  EXPECT_LT(found.summary.chi_square, 1.3);
  EXPECT_NE(found.summary.status, Status::unusable);
  EXPECT_EQ(found.summary.distrust(), nullptr);
  EXPECT_THAT(found.summary.trust, ::testing::StartsWith("Trust"));
  for (const auto& [name, value] :
       {std::pair("k1", m.k), std::pair("k2", m.cubic), std::pair("c", m.c), std::pair("e", m.e)}) {
    const Estimate& e = *found.model.parameter(name);
    EXPECT_LT(std::abs(e.value - value), 4 * e.sd) << name << " " << e.value << " +- " << e.sd << ", truth " << value;
    EXPECT_LT(std::abs(e.value / value - 1), name[0] == 'k' ? 0.02 : 2e-3) << name;
  }
}
INSTANTIATE_TEST_SUITE_P(Of, ManyEffectsProperty, ::testing::Values(41U, 42U));

}  // namespace
}  // namespace whirl::identification
