// Whether parts of the records ask for one set of coefficients.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"

namespace whirl::identification {
namespace {

using testing::DrivenOscillator;
using testing::DrivenRun;

Identification found(const std::vector<Recording>& records) {
  IdentifyOptions options;
  options.method = Method::sindy;
  options.sindy.states = {"x", "v"};
  options.sindy.inputs = {"u"};
  options.holdout = 0;
  return identify(records, options);
}

Recording named(Recording r, const std::string& name) {
  r.source = name;
  return r;
}

bool speaks_of_parts(const Identification& id) {
  for (const std::string& w : id.summary.warnings) {
    if (w.find("parts of the records ask for different coefficients") != std::string::npos) return true;
  }
  return false;
}

/// How far the machine's own coefficients are from those found; a term that is missing is outside by 99.
struct Tally {
  int all = 0, inside = 0, far = 0;  ///< far: beyond 4 standard deviations
  double worst = 0;
  void add(const Identification& id, const DrivenOscillator& machine) {
    for (const auto& [name, value] : machine.truth()) {
      const Estimate* e = id.model.parameter(name);
      const double off = e == nullptr ? 99 : std::abs(e->value - value) / e->sd;
      ++all;
      inside += off < 1.96;
      far += off > 4;
      worst = std::max(worst, off);
    }
  }
};

TEST(PartAgreementProperty, TwoMachinesAreNotOne) {
  Tally tally;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double factor = seed % 2 == 0 ? 1.04 : 0.96;
    const Identification id = found(
        {named(driven_record(machine, {.seed = seed}), "a.csv"),
         named(driven_record(machine, {.seed = seed + 50, .stiffness = [&](double) { return factor; }}), "b.csv")});
    EXPECT_NE(id.summary.status, Status::ok) << seed;
    EXPECT_TRUE(speaks_of_parts(id)) << seed << ": " << fmt::format("{}", id.summary.chi_square);
    tally.add(id, machine);
  }
  EXPECT_LE(tally.far, 1);
  EXPECT_LT(tally.worst, 8);
}

TEST(PartAgreementProperty, AChangeOfStiffnessWithinARecordIsTold) {
  Tally tally;
  for (unsigned seed = 11; seed <= 16; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const bool step = seed % 2 == 0;
    const Identification id = found({driven_record(machine, {.seed = seed, .stiffness = [&](double t) {
                                                               return step ? 1 + 0.05 * (t > 20) : 1 + 0.05 * t / 40;
                                                             }})});
    EXPECT_TRUE(speaks_of_parts(id)) << seed;
    tally.add(id, machine);
  }
  EXPECT_LE(tally.far, 1);
  EXPECT_LT(tally.worst, 8);
}

TEST(PartAgreementProperty, OneMachineIsOne) {
  Tally tally;
  for (unsigned seed = 21; seed <= 32; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double noise = seed % 3 == 0 ? 0.05 : seed % 3 == 1 ? 0.02 : 0.002;
    std::vector<Recording> records{named(driven_record(machine, {.seed = seed, .noise = noise}), "a.csv")};
    if (seed % 2 == 0)
      records.push_back(named(driven_record(machine, {.seed = seed + 50, .seconds = 15, .noise = noise}), "b.csv"));
    const Identification id = found(records);
    EXPECT_EQ(id.summary.status, Status::ok)
        << seed << (id.summary.warnings.empty() ? "" : id.summary.warnings.front());
    tally.add(id, machine);
  }
  EXPECT_GE(tally.inside, 0.88 * tally.all);
  EXPECT_EQ(tally.far, 0);
}

TEST(PartAgreementProperty, CorrelatedNoiseIsNoChangeAndIsInTheIntervals) {
  Tally tally;
  for (unsigned seed = 41; seed <= 50; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const Identification id = found({driven_record(machine, {.seed = seed, .correlation = 0.9})});
    EXPECT_FALSE(speaks_of_parts(id)) << seed;
    tally.add(id, machine);
  }
  EXPECT_GE(tally.inside, 0.78 * tally.all);  // 0.82: false terms of a few take the rest
  EXPECT_EQ(tally.far, 0);
}

}  // namespace
}  // namespace whirl::identification
