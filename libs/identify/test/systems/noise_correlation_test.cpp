// Noise that is correlated from one sample to the next.
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"
#include "whirl/testing/systems/identified_oscillator.hpp"

namespace whirl::identification {
namespace {

using testing::DrivenOscillator;
using testing::identified_oscillator;
using testing::Tally;

TEST(NoiseCorrelationProperty, ItIsFoundAndTheMachineWithIt) {
  Tally tally;
  int ok = 0;
  for (unsigned seed = 41; seed <= 52; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double correlation = seed % 3 == 0 ? 0.5 : seed % 3 == 1 ? 0.9 : 0.8;
    const Identification id =
        identified_oscillator({driven_record(machine, {.seed = seed, .correlation = correlation})});
    EXPECT_FALSE(testing::warns_of(id, "parts of the records")) << seed;
    ok += id.summary.status == Status::ok;
    if (id.summary.status == Status::ok) {
      EXPECT_NEAR(id.model.noise_correlation_of("x"), correlation, 0.1) << seed;
      EXPECT_NEAR(id.model.noise_correlation_of("v"), correlation, 0.1) << seed;
      EXPECT_NEAR(id.summary.chi_square, 1, 0.2) << seed;
    }
    tally.add(id, machine);
  }
  EXPECT_GE(ok, 10);
  EXPECT_LE(tally.extra, 4);
  EXPECT_GE(tally.inside, 0.88 * tally.all);
  EXPECT_EQ(tally.far, 0);
}

TEST(NoiseCorrelationProperty, WhiteNoiseIsWhite) {
  for (unsigned seed = 61; seed <= 66; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    EXPECT_TRUE(identified_oscillator({driven_record(machine, {.seed = seed})}).model.noise_correlation.empty());
  }
}

TEST(NoiseCorrelationProperty, WhatIsMissingIsNoNoise) {
  for (unsigned seed = 71; seed <= 78; ++seed) {
    DrivenOscillator machine = testing::drawn_oscillator(seed);
    machine.cubic *= seed % 2 == 0 ? 1 : 0.1;
    IdentifyOptions options;
    options.method = Method::sindy;
    options.sindy.states = {"x", "v"};
    options.sindy.inputs = {"u"};
    options.sindy.library = {"x", "v", "u"};
    options.holdout = 0;
    for (const double correlation : {0.0, 0.8}) {
      const Identification id =
          identify(driven_record(machine, {.seed = seed, .noise = 0.01, .correlation = correlation}), options);
      EXPECT_NE(id.summary.status, Status::ok) << seed << " " << correlation;
      EXPECT_TRUE(id.model.noise_correlation.empty()) << seed << " " << correlation;
    }
  }
}

TEST(NoiseCorrelationProperty, AForceThatIsNotMeasuredIsNoNoise) {
  for (unsigned seed = 91; seed <= 98; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double noise = seed % 2 == 0 ? 0.002 : 0.02;
    const Identification id =
        identified_oscillator({driven_record(machine, {.seed = seed, .noise = noise, .unmeasured = 0.1})});
    EXPECT_NE(id.summary.status, Status::ok) << seed;
    EXPECT_TRUE(id.model.noise_correlation.empty()) << seed;
  }
}

TEST(NoiseCorrelation, WhatIsGivenMustBeAStatesAndLessThanOne) {
  const Recording record = driven_record(testing::drawn_oscillator(1), {.seconds = 10});
  SindyOptions options;
  options.states = {"x", "v"};
  options.inputs = {"u"};
  for (const auto& [state, value] : {std::pair{"u", 0.5}, {"x", 1.0}, {"x", -0.1}}) {
    options.noise_correlation = {{state, value}};
    EXPECT_THROW(fit_sindy({record}, options), Error) << state << value;
  }
}

TEST(NoiseCorrelationProperty, AnotherRecordIsJudgedByTheSameNoise) {
  for (unsigned seed = 81; seed <= 84; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const Identification id = identified_oscillator({driven_record(machine, {.seed = seed, .correlation = 0.8})});
    ASSERT_EQ(id.summary.status, Status::ok) << seed;
    const Recording other = driven_record(machine, {.seed = seed + 40, .seconds = 20, .correlation = 0.8});
    for (const StateScore& s : score(id.model, other, 2)) EXPECT_NEAR(s.rmse / s.noise, 1, 0.35) << seed << s.state;
  }
}

}  // namespace
}  // namespace whirl::identification
