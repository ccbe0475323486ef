// Whether parts of the records ask for one set of coefficients.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "whirl/testing/systems/driven_oscillators.hpp"
#include "whirl/testing/systems/identified_oscillator.hpp"

namespace whirl::identification {
namespace {

using testing::DrivenOscillator;
using testing::identified_oscillator;
using testing::Tally;

Recording named(Recording r, const std::string& name) {
  r.source = name;
  return r;
}

bool speaks_of_parts(const Identification& id) { return id.model.summary.find(FindingCode::parts_differ) != nullptr; }

TEST(PartAgreementProperty, TwoMachinesAreNotOne) {
  Tally tally;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double factor = seed % 2 == 0 ? 1.04 : 0.96;
    const Identification id = identified_oscillator(
        {named(driven_record(machine, {.seed = seed}), "a.csv"),
         named(driven_record(machine, {.seed = seed + 50, .stiffness = [&](double) { return factor; }}), "b.csv")});
    EXPECT_NE(id.summary.status, Status::ok) << seed;
    EXPECT_TRUE(speaks_of_parts(id)) << seed << ": " << fmt::format("{}", id.summary.chi_square);
    EXPECT_TRUE(testing::warns_of(id, "by a.csv from")) << seed;
    EXPECT_TRUE(testing::warns_of(id, "by b.csv from")) << seed;
    tally.add(id, machine);
  }
  EXPECT_LE(tally.far, 1);
  EXPECT_LT(tally.worst, 8);
}

TEST(PartAgreementProperty, RecordsWithoutANameAreNumbered) {
  const DrivenOscillator machine = testing::drawn_oscillator(7);
  const Identification id =
      identified_oscillator({driven_record(machine, {.seed = 7}),
                             driven_record(machine, {.seed = 57, .stiffness = [](double) { return 1.04; }})});
  EXPECT_TRUE(testing::warns_of(id, "by record 1 from"));
  EXPECT_TRUE(testing::warns_of(id, "by record 2 from"));
}

TEST(PartAgreementProperty, AChangeOfStiffnessWithinARecordIsTold) {
  Tally tally;
  for (unsigned seed = 11; seed <= 16; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const bool step = seed % 2 == 0;
    const Identification id =
        identified_oscillator({driven_record(machine, {.seed = seed, .stiffness = [&](double t) {
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
    const Identification id = identified_oscillator(records);
    EXPECT_EQ(id.summary.status, Status::ok)
        << seed << (id.summary.warnings.empty() ? "" : id.summary.warnings.front());
    tally.add(id, machine);
  }
  EXPECT_GE(tally.inside, 0.88 * tally.all);
  EXPECT_EQ(tally.far, 0);
}

}  // namespace
}  // namespace whirl::identification
