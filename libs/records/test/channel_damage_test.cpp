#include "whirl/records/channel_damage.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::records {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A force of 7 Hz in noise; samples beyond `limit` are cut.
Recording force_record(double limit) {
  std::mt19937_64 engine(11);
  std::normal_distribution<double> noise(0, 0.01);
  Eigen::VectorXd samples(4000);
  for (Eigen::Index k = 0; k < samples.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    samples(k) = std::clamp(std::sin(44.0 * t) + noise(engine), -limit, limit);
  }
  Recording record;
  record.dt = 1e-3;
  record.t0 = 2;
  record.source = "sweep.csv";
  record.add("force", Quantity::force, samples);
  record.add("x", Quantity::displacement, Eigen::VectorXd::Zero(4000));
  return record;
}

TEST(ChannelDamage, NamesAndMasksAClippedForce) {
  const Recording record = force_record(0.8);
  const ChannelDamage damage = channel_damage(record, "force");
  ASSERT_EQ(damage.usable.size(), 4000);
  const Eigen::VectorXd& force = record["force"];
  for (Eigen::Index k = 0; k < force.size(); ++k) {
    if (std::abs(force(k)) == 0.8 && k > 0 && force(k - 1) == force(k)) {
      EXPECT_FALSE(damage.usable(k)) << k;
    }
  }
  EXPECT_GT(damage.usable.count(), 2000);
  // At both ends of the range.
  EXPECT_THAT(damage.warnings(record, 0, 4), ElementsAre(HasSubstr("sweep.csv: channel force: clipped"),
                                                         HasSubstr("sweep.csv: channel force: clipped")));
  // Only what concerns the samples asked for.
  EXPECT_THAT(damage.warnings(record, -2, -1), IsEmpty());
}

TEST(ChannelDamage, FindsNothingInASoundChannel) {
  const ChannelDamage damage = channel_damage(force_record(10), "force");
  EXPECT_EQ(damage.usable.size(), 0);
  EXPECT_THAT(damage.findings, IsEmpty());
}

TEST(ChannelDamage, RefusesANameThatIsNoChannel) { EXPECT_THROW(channel_damage(force_record(10), "z"), Error); }

}  // namespace
}  // namespace whirl::records
