#include "whirl/io/info.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/io/csv.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::io {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Eigen::VectorXd sine(double amplitude, double offset = 0) {
  Eigen::VectorXd x(2000);
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = offset + amplitude * std::sin(0.0731 * static_cast<double>(i));
  return x;
}

ChannelInfo info_of(Eigen::VectorXd x, Quantity q = Quantity::displacement) {
  SignalTable table{.abscissa = Quantity::time, .step = 1e-3};
  table.signals.push_back({"x", std::string(si_unit(q)), q, std::move(x), {}});
  return describe(SignalFile{.tables = {table}}).tables[0].channels[0];
}

TEST(Info, ACleanSineHasNoFindings) {
  const ChannelInfo c = info_of(sine(2));
  EXPECT_THAT(c.findings, IsEmpty());
  EXPECT_THAT(c.damage, IsEmpty());
  EXPECT_NEAR(c.rms, std::sqrt(2.0), 1e-2);
  EXPECT_NEAR(c.maximum, 2, 1e-2);
}

TEST(Info, FindsWhatIsSuspicious) {
  EXPECT_THAT(info_of(Eigen::VectorXd::Zero(50)).findings, ElementsAre(HasSubstr("constant")));
  EXPECT_THAT(info_of(sine(2).cwiseMin(1.5)).damage, ElementsAre(HasSubstr("clipped: the maximum 1.5 m")));
  Eigen::VectorXd frozen = sine(2);
  frozen.segment(500, 50).setConstant(frozen[500]);
  EXPECT_THAT(info_of(frozen).damage, ElementsAre(HasSubstr("frozen: 50 equal samples from 0.5 s on")));
  EXPECT_THAT(info_of(sine(0.1, 5)).findings, ElementsAre(HasSubstr("remove the offset?")));
  EXPECT_THAT(info_of(sine(0.1, 5), Quantity::angular_velocity).findings, IsEmpty());
  Eigen::VectorXd spike = sine(1);
  spike[77] = 9;
  EXPECT_THAT(info_of(spike).damage, ElementsAre(HasSubstr("1 single-sample spikes, the first at 0.077 s")));
  // A hammer pulse of six samples in noise, and the corner that it makes in a response, are no spikes.
  Eigen::VectorXd pulse = 1e-3 * sine(1);
  for (int i = 0; i < 6; ++i) pulse[200 + i] += 50 * std::sin(std::numbers::pi * (i + 0.4) / 6);
  for (const std::string& finding : info_of(pulse, Quantity::force).damage)
    EXPECT_THAT(finding, Not(HasSubstr("spike")));
  const Eigen::VectorXd coarse = (sine(2) * 4).array().round();
  EXPECT_THAT(info_of(coarse).findings,
              ElementsAre(HasSubstr("coarse: about 17 levels"), HasSubstr("repeat their neighbour")));
}

// Eight samples a period jump by an eighth of the range at least: that is no coarse converter.
TEST(InfoReference, AShortPeriodIsNotCoarse) {
  Eigen::VectorXd x(4000);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x[i] = std::cos(2 * std::numbers::pi * 0.125 * static_cast<double>(i)) * (1 + 1e-5 * static_cast<double>(i));
  EXPECT_THAT(info_of(x).findings, IsEmpty());
}

TEST(InfoReference, TheMeasuredHammerRecordIsDescribed) {
  const auto file = testing::data_file("modal/hammer_raw.csv.gz");
  WHIRL_REQUIRE_DATA(file);
  const FileInfo info = describe(read_signals(file));
  ASSERT_EQ(info.tables.size(), 1u);
  EXPECT_EQ(info.tables[0].rows, 50030);
  EXPECT_DOUBLE_EQ(1 / info.tables[0].step, 50000);
  EXPECT_THAT(to_string(info), HasSubstr("50030 samples, 50000 Hz, 1.0006 s"));
}

}  // namespace
}  // namespace whirl::io
