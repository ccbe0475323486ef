// The verdict of a report gives advice by what was measured, not by a guessed speed or the zone of a run.
#include "whirl/pages/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// 500 um at `orders` of a speed that runs from `from` to `to` (Hz) in 20 s; `angle`: with the rotor's.
Recording turning(double from, double to, bool angle) {
  Recording record;
  record.dt = 1e-3;
  Eigen::VectorXd x(20000), beta(20000);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    beta[i] = kTwoPi * (from * t + 0.5 * (to - from) / 20 * t * t);
    x[i] = 5e-4 * std::cos(beta[i]) + 1e-6 * std::sin(12345.678 * t * t);
  }
  record.add("x", Quantity::displacement, x);
  if (angle) record.add("beta", Quantity::angle, beta);
  return record;
}

std::string cell(const Recording& record, const std::string& row) {
  const report::Table table = verdict_table({verdict_on("run.csv", record, 0)}, {});
  for (const auto& cells : table.rows)
    if (cells.front() == row) return cells.at(1);
  return "no row " + row;
}

TEST(Verdict, ASteadyRunInZoneDAsksToStop) {
  const Recording steady = turning(25, 25, true);
  EXPECT_EQ(cell(steady, "zone"), "D");
  EXPECT_THAT(cell(steady, "next step"), HasSubstr("stop or limit the speed"));
  EXPECT_THAT(cell(steady, "next step"), HasSubstr("balance"));
}

TEST(Verdict, TheZoneOfARunIsForOrientation) {
  const Recording run = turning(10, 30, true);
  EXPECT_THAT(cell(run, "zone"), HasSubstr("the speed changes: for orientation"));
  EXPECT_THAT(cell(run, "next step"), Not(HasSubstr("stop")));
  EXPECT_THAT(cell(run, "next step"), Not(HasSubstr("balance")));
  EXPECT_THAT(cell(run, "next step"), HasSubstr("record at the service speed"));
}

TEST(Verdict, AGuessedSpeedIsSaidAndGivesNoAdvice) {
  const Recording unknown = turning(25, 25, false);
  EXPECT_THAT(cell(unknown, "findings"), HasSubstr("speed not measured; at 1500 rpm"));
  EXPECT_EQ(cell(unknown, "next step"), "record with a tacho: 1500 rpm is taken from the largest line");
}

}  // namespace
}  // namespace whirl::pages
