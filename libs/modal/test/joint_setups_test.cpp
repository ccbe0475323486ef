// Ambient tests with few sensors that move on from record to record.
#include <gtest/gtest.h>

#include "whirl/core/error.hpp"
#include "whirl/modal/oma.hpp"
#include "whirl/modal/order_modes.hpp"
#include "whirl/modal/poles.hpp"
#include "whirl/testing/ambient.hpp"

namespace {

using namespace whirl;
using modal::OperationalModes;
using whirl::testing::make_roving_setups;

struct SetupScore {
  int found = 0, frequency = 0, damping = 0, extra = 0;
  std::vector<double> mac;
};

void add_setup(const whirl::testing::RovingSetups& truth, const OperationalModes& found, SetupScore& score) {
  std::vector<bool> used(found.modes.size());
  for (std::size_t k = 0; k < truth.frequency.size(); ++k) {
    std::size_t best = found.modes.size();
    double nearest = 0.006;
    for (std::size_t m = 0; m < found.modes.size(); ++m) {
      const double d = std::abs(found.modes[m].frequency.value / truth.frequency[k] - 1);
      if (used[m] || d >= nearest) continue;
      nearest = d;
      best = m;
    }
    if (best == found.modes.size()) continue;
    used[best] = true;
    const modal::OperationalMode& mode = found.modes[best];
    ++score.found;
    score.frequency += mode.frequency.covers(truth.frequency[k]);
    score.damping += mode.damping.covers(truth.damping[k]);
    const auto points = static_cast<Eigen::Index>(truth.shape[k].size());
    score.mac.push_back(
        modal::mac(mode.shape, Eigen::VectorXd::Map(truth.shape[k].data(), points).cast<std::complex<double>>()));
  }
  score.extra += static_cast<int>(std::count(used.begin(), used.end(), false));
}

bool warns(const OperationalModes& found, const std::string& text) {
  return std::any_of(found.summary.warnings.begin(), found.summary.warnings.end(),
                     [&](const std::string& w) { return w.find(text) != std::string::npos; });
}

// Forces of another size and direction in every record.
TEST(JointSetupsProperty, OneModelOfThreeRecordsGivesModesAndShapesOfFourteenPoints) {
  SetupScore score;
  for (unsigned seed = 61; seed <= 65; ++seed) {
    const auto truth = make_roving_setups({.structure = seed - 52, .seed = seed});
    const OperationalModes found = modal::identify_joint(truth.records);
    ASSERT_EQ(found.channels.size(), 14u);
    EXPECT_EQ(found.channels[2], "p2");
    add_setup(truth, found, score);
    EXPECT_FALSE(warns(found, "differs between"));
    ASSERT_EQ(found.tones.size(), 2u);
  }
  EXPECT_GE(score.found, 36);  // 96 % over 20 tests
  EXPECT_LE(score.extra, 1);
  EXPECT_GE(score.frequency, score.found - 4);
  EXPECT_GE(score.damping, score.found - 4);
  std::sort(score.mac.begin(), score.mac.end());
  EXPECT_GT(score.mac[score.mac.size() / 2], 0.99);
  EXPECT_GT(score.mac[score.mac.size() / 5], 0.95);
}

TEST(JointSetups, OneRecordAloneIsAsWithoutJoining) {
  const auto truth = make_roving_setups({.setups = 1, .moving = 4, .structure = 3, .seed = 71});
  const OperationalModes alone = modal::identify_operational(truth.records[0]);
  SetupScore score;
  add_setup(truth, modal::identify_joint(truth.records), score);
  EXPECT_EQ(score.found, static_cast<int>(alone.modes.size()));
  EXPECT_EQ(score.extra, 0);
}

// Warming moves all frequencies by 0.3 % from record to record: more than each record's own error.
TEST(MergedSetupsProperty, StructuresThatChangeBetweenSetUpsAreSaidAndTheIntervalsHold) {
  SetupScore score;
  int said = 0;
  for (unsigned seed = 81; seed <= 84; ++seed) {
    const auto truth = make_roving_setups({.frequency_spread = 0.003, .structure = seed - 70, .seed = seed});
    std::vector<OperationalModes> setups;
    for (const Recording& record : truth.records) setups.push_back(modal::identify_operational(record));
    const OperationalModes found = modal::merge_setups(setups);
    add_setup(truth, found, score);
    said += warns(found, "between the set-ups");
  }
  EXPECT_GE(score.found, 29);
  EXPECT_GE(score.frequency, 0.78 * score.found);  // one draw of the warming moves all modes of a test; 96 % over 20
  EXPECT_GE(said, 3);
}

TEST(MergedSetupsProperty, StructuresThatStayAreNotAccused) {
  for (unsigned seed = 91; seed <= 92; ++seed) {
    const auto truth = make_roving_setups({.structure = seed - 80, .seed = seed});
    std::vector<OperationalModes> setups;
    for (const Recording& record : truth.records) setups.push_back(modal::identify_operational(record));
    EXPECT_FALSE(warns(modal::merge_setups(setups), "between the set-ups"));
  }
}

TEST(JointSetups, RecordsThatCannotBeJoinedAreRefused) {
  auto truth = make_roving_setups({.duration = 60, .structure = 2, .seed = 95});
  auto other = truth.records;
  other[1].dt *= 2;
  EXPECT_THROW(modal::identify_joint(other), Error);
  other = truth.records;
  for (auto& channel : other[2].channels) channel.name += "_moved";
  EXPECT_THROW(modal::identify_joint(other), Error);
  other = truth.records;
  for (auto& channel : other[1].channels) channel.quantity = Quantity::acceleration;
  EXPECT_THROW(modal::identify_joint(other), Error);
  EXPECT_THROW(modal::identify_joint({}), Error);
}

TEST(IdentifySetups, EveryWayIsTheOneItNames) {
  const auto truth = make_roving_setups({.duration = 60, .structure = 3, .seed = 96});
  const auto same = [](const OperationalModes& a, const OperationalModes& b) {
    ASSERT_EQ(a.modes.size(), b.modes.size());
    for (std::size_t k = 0; k < a.modes.size(); ++k) EXPECT_EQ(a.modes[k].frequency.value, b.modes[k].frequency.value);
  };
  same(modal::identify_setups({truth.records[0]}), modal::identify_operational(truth.records[0]));
  same(modal::identify_setups(truth.records, {.joint = true}), modal::identify_joint(truth.records));
  modal::OmaOptions covariance;
  covariance.method = modal::SubspaceMethod::covariance;
  std::vector<OperationalModes> each;
  for (const Recording& record : truth.records) each.push_back(modal::identify_operational(record, covariance));
  same(modal::identify_setups(truth.records, {.method = "ssi-cov"}), modal::merge_setups(each));
  EXPECT_THROW(modal::identify_setups({}), Error);
  EXPECT_THROW(modal::identify_setups(truth.records, {.method = "ssi"}), Error);
  EXPECT_THROW(modal::identify_setups(truth.records, {.method = "orders", .joint = true}), Error);
}

}  // namespace
