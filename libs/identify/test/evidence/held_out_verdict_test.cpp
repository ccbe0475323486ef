#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/expr/library.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/oscillators.hpp"
#include "whirl/testing/systems/short_decays.hpp"

namespace whirl::identification {
namespace {

using ::testing::HasSubstr;

double coefficient(const IdentifiedModel& m, const std::string& function) {
  for (const EquationTerm& t : m.equations.back().terms) {
    if (t.function == function) return t.coefficient.value;
  }
  return 0;
}

class SecondOrderProperty : public ::testing::TestWithParam<double> {};

// The equation comes back from finely sampled noisy records, where a second difference is noise alone.
TEST_P(SecondOrderProperty, OscillatorsFromNoisyFinelySampledRecords) {
  const double noise = GetParam();
  for (const unsigned seed : {31u, 32u}) {
    for (const testing::Oscillator& o : testing::oscillators(seed)) {
      IdentifyOptions options;
      options.method = Method::second_order;
      const Identification found = identify(testing::oscillator_record(o, 2e-3, 10000, noise, seed), options);
      SCOPED_TRACE(o.name + " seed " + std::to_string(seed));
      EXPECT_EQ(found.summary.status, Status::ok) << (found.summary.warnings.empty() ? "" : found.summary.warnings[0]);
      EXPECT_NEAR(coefficient(found.model, "y"), -o.stiffness, (1e-3 + 0.2 * noise) * o.stiffness);
      EXPECT_NEAR(coefficient(found.model, "y'"), -o.damping, (1e-3 + 0.6 * noise) * o.damping);
      EXPECT_NEAR(coefficient(found.model, "u"), o.gain, (1e-3 + 0.4 * noise) * o.gain);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Noise, SecondOrderProperty, ::testing::Values(0.0, 0.01, 0.05));

// The last third of a decay that is over holds noise: what its scatter leaves is no error of the model.
TEST(HeldOutVerdictProperty, PartWithoutMotionRefusesNoModel) {
  const testing::ShortDecay d = testing::short_decays()[1];
  int said = 0;
  for (const std::uint64_t seed : {201u, 202u, 203u, 204u, 205u, 206u, 207u, 208u}) {
    IdentifyOptions options;
    options.method = Method::sindy;
    const Identification found = identify(testing::short_decay_record(d, 0.02, seed), options);
    EXPECT_NE(found.summary.status, Status::unusable) << found.summary.warnings.back();
    said += found.summary.trust.find("holds hardly more than noise") != std::string::npos;
  }
  EXPECT_GE(said, 6);
}

/// Oscillator whose spring is another one in the last quarter of the record.
Recording broken_record(unsigned seed, double last) {
  testing::Oscillator o = testing::oscillators(seed).front();
  const double k = o.stiffness, c = o.damping, seconds = 20;
  o.force = [=](double x, double v, double t) { return -(t < 0.75 * seconds ? k : last * k) * x - c * v; };
  return testing::oscillator_record(o, 4e-3, 5000, 0.01, seed);
}

std::vector<std::pair<std::string, IdentifyOptions>> methods() {
  IdentifyOptions second, sindy, library, unrefined;
  second.method = Method::second_order;
  sindy.method = Method::sindy;
  sindy.sindy.states = {"y"};
  sindy.sindy.inputs = {"u"};
  sindy.sindy.order = 2;
  sindy.sindy.timing.find = false;
  library = sindy;
  library.library = expr::CandidateLibrary{{"y''"}, {"y", "y'", "u"}, {}, {}};
  for (const char* term : {"y", "y'", "u"}) {
    library.library->groups.push_back(expr::tied_group(term, {expr::Expr::parse(term)}));
  }
  unrefined = sindy;
  unrefined.sindy.refine = false;
  return {{"second-order", second}, {"sindy", sindy}, {"library", library}, {"unrefined", unrefined}};
}

// A part held out that a model of the rest misses makes the numbers unusable, by every method.
TEST(HeldOutVerdictProperty, MissedPartMakesEveryMethodUnusable) {
  for (const auto& [name, options] : methods()) {
    for (const unsigned seed : {41u, 42u, 43u}) {
      SCOPED_TRACE(name + " seed " + std::to_string(seed));
      const Identification found = identify(broken_record(seed, 3), options);
      EXPECT_EQ(found.summary.status, Status::unusable);
      EXPECT_THAT(found.summary.trust, HasSubstr("Do not"));
      const Identification sound = identify(broken_record(seed, 1), options);
      EXPECT_NE(sound.summary.status, Status::unusable);
      EXPECT_THAT(sound.summary.trust, ::testing::StartsWith(name == "second-order" ? "rms" : "Trust"));
    }
  }
}

// A change that the model follows badly, though not hopelessly, takes its trust.
TEST(HeldOutVerdictProperty, ErrorBeyondTwiceTheNoiseWithdrawsTrust) {
  for (const auto& [name, options] : methods()) {
    if (name == "unrefined") continue;
    for (const unsigned seed : {51u, 52u}) {
      SCOPED_TRACE(name + " seed " + std::to_string(seed));
      const Identification found = identify(broken_record(seed, 1.1), options);
      EXPECT_NE(found.summary.status, Status::ok);
      EXPECT_THAT(found.summary.trust, HasSubstr("Do not"));
    }
  }
}

}  // namespace
}  // namespace whirl::identification
