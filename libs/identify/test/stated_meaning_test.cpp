// What a verdict says is what its model has, and what the part held out can show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "whirl/identify/identify.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/machines.hpp"
#include "whirl/testing/systems/two_criticals.hpp"

namespace whirl::identification {
namespace {

constexpr double kTurns = 2 * std::numbers::pi;

TEST(StatedMeaningProperty, AModeIsNamedByItsRefinedFrequency) {
  const testing::TwoCriticals machine = testing::draw_two_criticals(4);
  testing::Run run;
  run.from_hz = 3, run.to_hz = 1.35 * machine.w / kTurns, run.seconds = 20;
  const RotorIdentification found =
      identify_rotor_detailed(std::vector<Recording>{testing::two_criticals_record(machine, run, 40, 4)}, {});
  const std::vector<ForcedMode>& modes = found.model.rotor->modes;
  ASSERT_FALSE(modes.empty());
  const auto off = [&](double hz) {
    double nearest = INFINITY;
    for (const ForcedMode& m : modes) nearest = std::min(nearest, std::abs(hz - m.omega / kTurns));
    return nearest;
  };
  std::size_t named = 0;
  for (const std::string& label : found.added) {
    double hz = 0;
    if (std::sscanf(label.c_str(), "mode %lf Hz", &hz) != 1) continue;
    ++named;
    EXPECT_LT(off(hz), 0.001 * hz) << label;
  }
  EXPECT_GE(named, 1u);
  for (const std::string& w : found.model.summary.warnings) {
    double hz = 0;
    if (std::sscanf(w.c_str(), "mode %lf Hz is found", &hz) != 1) continue;
    EXPECT_LT(off(hz), 0.001 * hz) << w;
  }
}

TEST(StatedMeaningProperty, CrossCouplingThatIsFoundIsNotInC) {
  int seen = 0;
  for (const unsigned seed : {601U, 602U, 603U}) {
    const testing::DrawnMachine drawn = testing::draw_machine(testing::Oddity::cross_coupled, seed);
    const Identification id = identify(testing::machine_record(drawn, 40, seed));
    if (!id.usable() || id.summary.distrust() != nullptr) continue;
    const bool found = id.model.parameter("k_cross") != nullptr;
    seen += found;
    const bool said = id.summary.trust.find("c includes any cross-coupled") != std::string::npos;
    EXPECT_NE(said, found) << seed << ": " << id.summary.trust;
  }
  EXPECT_GT(seen, 0);
}

// Of two records the last alone passes the critical speed: without it nothing shows k1.
TEST(HeldOutProperty, ARestWithoutTheCriticalSpeedNeitherWidensNorRefuses) {
  for (const unsigned seed : {611U, 612U, 613U, 614U}) {
    testing::DrawnMachine slow = testing::draw_machine(testing::Oddity::none, seed);
    const double critical = std::sqrt(slow.machine.k) / kTurns;
    const testing::DrawnMachine through = slow;
    slow.run.from_hz = 2;
    slow.run.to_hz = 0.7 * critical;
    const Identification id =
        identify({testing::machine_record(slow, 40, seed), testing::machine_record(through, 40, seed + 50)});
    ASSERT_NE(id.summary.status, Status::unusable) << seed << ": " << id.summary.warnings.back();
    const Finding* open = id.summary.find(FindingCode::held_out_cannot_check);
    ASSERT_NE(open, nullptr) << seed;
    EXPECT_NEAR(open->amount("frequency"), critical, 0.02 * critical);
    EXPECT_LT(open->amount("high"), critical);
    EXPECT_EQ(id.summary.find(FindingCode::parameter_differs), nullptr) << seed;
    EXPECT_EQ(id.summary.find(FindingCode::held_out_not_predicted), nullptr) << seed;
    const Estimate& k1 = *id.model.parameter("k1");
    EXPECT_TRUE(k1.covers(through.machine.k)) << seed;
    EXPECT_LT(k1.high - k1.low, 0.01 * through.machine.k) << seed;
  }
}

// A rest that passes the critical speed tests the model as before.
TEST(HeldOutProperty, ARestThatPassesItTestsTheModel) {
  for (const unsigned seed : {621U, 622U}) {
    const testing::DrawnMachine d = testing::draw_machine(testing::Oddity::none, seed);
    const Identification id = identify(testing::machine_record(d, 40, seed));
    EXPECT_TRUE(id.evidence.not_shown.empty()) << seed;
    EXPECT_FALSE(id.evidence.held_out.scores.empty()) << seed;
  }
}

// A second critical speed that only the part held out passes.
TEST(HeldOutProperty, ARestWithoutTheSecondCriticalSpeedDoesNotRefuse) {
  const testing::TwoCriticals machine = testing::draw_two_criticals(2);
  testing::Run run;
  run.from_hz = 3, run.to_hz = 1.3 * machine.w / kTurns, run.seconds = 20;
  const Recording record = testing::two_criticals_record(machine, run, 40, 2);
  for (const double share : {0.1, 0.6}) {
    IdentifyOptions o;
    o.holdout = share;
    const Identification id = identify(record, o);
    EXPECT_NE(id.summary.status, Status::unusable) << share << ": " << id.summary.warnings.back();
    EXPECT_FALSE(id.model.rotor->modes.empty());
  }
}

// A run-down passes the second critical speed first: a rest that ends in the passage of the first one, whose motion
// comes after it, shows the second alone or takes it for the rotor's.
TEST(HeldOutProperty, ARestThatEndsInThePassageOfTheFirstCriticalSpeedDoesNotRefuse) {
  int cut = 0;
  for (const unsigned seed : {2U, 5U}) {
    testing::TwoCriticals machine = testing::draw_two_criticals(seed);
    machine.first.c *= 0.3, machine.first.cubic = 0, machine.zeta *= 0.3;  // rings long
    const double critical = std::sqrt(machine.first.k) / kTurns;
    testing::Run run;
    run.from_hz = 1.3 * machine.w / kTurns, run.to_hz = 3, run.seconds = 12;
    const Recording record = testing::two_criticals_record(machine, run, 40, seed);
    for (const double share : {0.1, 0.3, 0.6}) {  // of the vibration energy
      IdentifyOptions o;
      o.holdout = share;
      const Identification id = identify(record, o);
      EXPECT_NE(id.summary.status, Status::unusable) << seed << ' ' << share << ": " << id.summary.warnings.back();
      const Estimate& k1 = *id.model.parameter("k1");
      EXPECT_TRUE(k1.covers(machine.first.k)) << seed << ' ' << share;
      EXPECT_LT(k1.high - k1.low, 0.01 * machine.first.k) << seed << ' ' << share;
      const Finding* open = id.summary.find(FindingCode::held_out_cannot_check);
      if (open == nullptr) continue;
      ++cut;
      EXPECT_NEAR(open->amount("frequency"), critical, 0.02 * critical);
    }
  }
  EXPECT_GE(cut, 2);
}

// Orbits that are nearly circles do not tell a radial spring from springs along the axes.
TEST(AmbiguityProperty, TheOtherReadingIsInTheModelFileAsNumbers) {
  Identification id;
  for (unsigned seed = 631; seed < 641; ++seed) {  // where the noise hides which it is
    id = identify(testing::machine_record(testing::draw_machine(testing::Oddity::none, seed), 20, seed));
    if (std::ranges::count(id.model.ambiguities, false, &Ambiguity::covered) > 0) break;
  }
  const IdentifiedModel read =
      io::from_json<IdentifiedModel>(io::parse_json(io::to_json(id.model).dump(), "model.json"), "model.json");
  ASSERT_EQ(read.ambiguities.size(), id.model.ambiguities.size());
  const auto open = std::ranges::find(read.ambiguities, false, &Ambiguity::covered);
  ASSERT_NE(open, read.ambiguities.end());
  ASSERT_EQ(open->alternatives.size(), 1u);
  EXPECT_EQ(open->alternatives[0].odds, 1);
  const std::vector<ModelReading> others = other_readings(read);
  ASSERT_EQ(others.size(), 1u);
  EXPECT_EQ(others[0].model.rotor->k2, 0);
  const Estimate &radial = *read.parameter("k2"), &axes = *others[0].model.parameter("k2_axis");
  EXPECT_NEAR(axes.value, radial.value * 4 / 3, 1e-9 * radial.value);
  // Other ambiguities may have widened the interval of k2 since.
  EXPECT_GT(axes.sd, 0);
  EXPECT_LE(axes.sd / axes.value, radial.sd / radial.value * (1 + 1e-9));
  // k2_axis moves with k1 as k2 did.
  const auto place = [](const IdentifiedModel& m, const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(m.parameters, name, [](const auto& p) { return p.first; }) -
                                    m.parameters.begin());
  };
  const auto correlation = [&](const IdentifiedModel& m, const std::string& a, const std::string& b) {
    const std::size_t n = m.parameters.size(), i = place(m, a), j = place(m, b);
    const std::vector<double>& c = m.parameter_covariance;
    return c[i * n + j] / std::sqrt(c[i * n + i] * c[j * n + j]);
  };
  EXPECT_NEAR(correlation(others[0].model, "k1", "k2_axis"), correlation(read, "k1", "k2"), 1e-9);
}

}  // namespace
}  // namespace whirl::identification
