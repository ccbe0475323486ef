#include "whirl/identify/partwise_score.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

/// One well and no chaos: runs from nearly equal starts stay together.
testing::ZooSystem forced_duffing() {
  testing::ZooSystem s;
  s.name = "Duffing, one well";
  s.truth = testing::zoo_model({{"x", {{1, "v"}}}, {"v", {{-0.3, "v"}, {-1, "x"}, {-1, "x^3"}, {1, "u"}}}}, {"u"});
  s.start = {1, 0};
  s.dt = 0.02;
  s.samples = 4000;
  s.input = [](double t) { return 0.5 * std::cos(1.2 * t); };
  return s;
}

TEST(PartwiseScoreReference, PartsOfAnyLengthGiveTheScoreOfTheWhole) {
  const testing::ZooSystem s = forced_duffing();
  const Recording r = testing::zoo_record(s, 0.01, 5);
  SindyOptions o;
  o.states = {"x", "v"};
  o.inputs = {"u"};
  const IdentifiedModel m = fit_sindy({r}, o);
  const double period = characteristic_period(r, o.states);
  for (const double horizon : {0.0, period}) {
    const std::vector<StateScore> whole = score(m, r, horizon);
    for (const Eigen::Index length : {Eigen::Index(40), Eigen::Index(333), Eigen::Index(1000)}) {
      PartwiseScore parts(m, horizon, period);
      for (Eigen::Index first = 0; first < r.size(); first += length) {
        parts.add(part_of(r, first, std::min(length, r.size() - first)));
      }
      const std::vector<StateScore> joined = parts.finish();
      ASSERT_EQ(joined.size(), whole.size());
      for (std::size_t k = 0; k < whole.size(); ++k) {
        EXPECT_EQ(joined[k].state, whole[k].state);
        EXPECT_NEAR(joined[k].rmse / whole[k].rmse, 1, 1e-3) << "horizon " << horizon << " length " << length;
        EXPECT_NEAR(joined[k].nrmse / whole[k].nrmse, 1, 1e-3) << "horizon " << horizon << " length " << length;
        EXPECT_NEAR(joined[k].noise / whole[k].noise, 1, length < 100 ? 0.3 : 0.1);
      }
    }
  }
}

TEST(PartwiseScore, ARunThatDivergesInOnePartIsInfiniteForTheWhole) {
  const Recording r = testing::zoo_record(forced_duffing(), 0.01, 5);
  IdentifiedModel m;
  m.method = "sindy";
  m.states = {"x", "v"};
  m.inputs = {"u"};
  m.equations = {{"x'", {{"v", {1, 0, 1, 1}, ""}}}, {"v'", {{"x^3", {1, 0, 1, 1}, ""}}}};
  HeldOutParts parts(m, "the rest");
  for (Eigen::Index first = 0; first + 200 <= r.size(); first += 200) parts.add(part_of(r, first, 200));
  const HeldOut held = parts.finish();
  EXPECT_EQ(held.reason, "");
  ASSERT_EQ(held.scores.size(), 2u);
  for (const StateScore& s : held.scores) EXPECT_TRUE(std::isinf(s.rmse));
}

}  // namespace
}  // namespace whirl::identification
