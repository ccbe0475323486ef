#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::identification {
namespace {

using testing::DrawnMachine;
using testing::Oddity;

/// A run-down of the machine as drawn, and a run-up after it changed.
std::vector<Recording> two_runs(const DrawnMachine& d, double stiffness, double damping, double snr, unsigned seed) {
  DrawnMachine later = d;
  later.machine.k *= stiffness;
  later.machine.c *= damping;
  std::swap(later.run.from_hz, later.run.to_hz);
  std::vector<Recording> runs = {testing::machine_record(d, snr, seed), testing::machine_record(later, snr, seed + 1)};
  runs[0].source = "cold";
  runs[1].source = "warm";
  return runs;
}

// Records of a machine that warmed up between them have springs of their own: one spring for all left half of the
// motion unexplained at 20 dB ("wrong angle, wrong channels") and a chi-square of 70 at 40 dB.
TEST(ChangedMachineProperty, ASpringThatDiffersBetweenTheRecordsIsFound) {
  for (const auto& [seed, snr] : {std::pair(731U, 20.0), {732U, 40.0}}) {
    SCOPED_TRACE(fmt::format("seed {}, {} dB", seed, snr));
    const DrawnMachine d = testing::draw_machine(Oddity::none, seed);
    const double stiffness = seed % 2 == 0 ? 1.01 : 0.985;
    const RotorIdentification r = identify_rotor_detailed(two_runs(d, stiffness, 1, snr, seed), {});
    ASSERT_EQ(r.model.summary.status, Status::warning);
    EXPECT_THAT(r.model.summary.warnings, ::testing::Contains(::testing::HasSubstr("k1 of warm is")));
    const std::pair<const char*, double> truths[] = {{"k1", d.machine.k},
                                                     {"k2", d.machine.cubic},
                                                     {"c", d.machine.c},
                                                     {"e", std::abs(d.machine.e)},
                                                     {"k1_change_2", (stiffness - 1) * d.machine.k}};
    for (const auto& [name, truth] : truths) {
      const Estimate* e = r.model.parameter(name);
      ASSERT_NE(e, nullptr) << name;
      EXPECT_LT(std::abs(e->value - truth), 4 * e->sd) << name << " " << e->value << " truth " << truth;
    }
  }
}

TEST(ChangedMachineProperty, ADamperThatDiffersIsFound) {
  const DrawnMachine d = testing::draw_machine(Oddity::none, 733);
  const RotorIdentification r = identify_rotor_detailed(two_runs(d, 1, 1.3, 40, 733), {});
  const Estimate* change = r.model.parameter("c_change_2");
  ASSERT_NE(change, nullptr);
  EXPECT_LT(std::abs(change->value - 0.3 * d.machine.c), 4 * change->sd);
  EXPECT_EQ(r.model.parameter("k1_change_2"), nullptr);
}

// Another force of the rotor is no change between the records, and no change is none.
TEST(ChangedMachineProperty, TheSameMachineTwiceHasOneSpring) {
  for (const Oddity oddity : {Oddity::none, Oddity::quintic, Oddity::gyroscopic, Oddity::quadratic_damping}) {
    DrawnMachine d = testing::draw_machine(oddity, 734);
    std::vector<Recording> runs = {testing::machine_record(d, 40, 734)};
    d.machine.e *= 1.5;
    runs.push_back(testing::machine_record(d, 40, 735));
    const RotorIdentification r = identify_rotor_detailed(runs, {});
    SCOPED_TRACE(to_string(oddity));
    EXPECT_EQ(r.model.parameter("k1_change_2"), nullptr);
    EXPECT_EQ(r.model.parameter("c_change_2"), nullptr);
    EXPECT_LT(std::abs(r.model.parameter("k1")->value - d.machine.k), 4 * r.model.parameter("k1")->sd);
  }
}

}  // namespace
}  // namespace whirl::identification
