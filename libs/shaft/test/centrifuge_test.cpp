#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/centrifuge/speed_limits.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/testing/shaft/centrifuge_rig.hpp"

namespace whirl::shaft {
namespace {

RotorJob template_job() { return parse_rotor_job(rotor_template("centrifuge"), "centrifuge"); }

OrderRun spin_up(const testing::CentrifugeRig& rig) {
  const Recording record = testing::CentrifugeRigModel(rig).run();
  return order_run(record, 0, record["beta"], {"housing"}, "spin-up");
}

LoadCheck check_rig(const RotorJob& job, const testing::CentrifugeRig& rig) {
  return check_load(job.rotor, job.centrifuge, spin_up(rig), {centrifuge_sensors(job.rotor, job.centrifuge).front()});
}

testing::CentrifugeRig loading(double grams, double degrees) {
  testing::CentrifugeRig rig;
  rig.size = 1e-3 * grams * 0.09;
  rig.angle = degrees * kRadPerDegree;
  rig.load = 0.2;
  rig.noise_density = 110e-6 * 9.80665;
  return rig;
}

/// The rig is made of rigid parts and a massless beam: by their order of stiffness it is within 1 % of the elements.
TEST(CentrifugeReference, ARecordWithoutNoiseGivesTheImbalance) {
  RotorJob job = template_job();
  job.centrifuge.tolerance = {};
  job.centrifuge.load = 0.4;
  testing::CentrifugeRig rig = loading(8, 100);
  rig.noise_density = 0;
  const LoadCheck c = check_rig(job, rig);
  EXPECT_NEAR(c.imbalance.value, 8e-3, 8e-5);
  EXPECT_NEAR(c.angle.value, 100 * kRadPerDegree, 0.01);
  EXPECT_LT(c.decided_at, 0.5 * c.first_critical);
  EXPECT_EQ(c.summary.status, Status::ok) << c.misfit_deviations;
}

TEST(CentrifugeReference, TheBucketAndItsChangeAreNamed) {
  const RotorJob job = template_job();
  const LoadCheck c = check_rig(job, loading(8, 100));
  EXPECT_EQ(c.verdict, LoadVerdict::wrong);
  EXPECT_TRUE(c.imbalance.covers(8e-3)) << c.imbalance.low << " to " << c.imbalance.high;
  EXPECT_EQ(c.named, std::vector<int>{2});
  ASSERT_EQ(c.changes.size(), 2u);
  for (const BucketChange& change : c.changes) {
    const double along = 8e-3 * std::cos((100 - 90 * (change.bucket - 1)) * kRadPerDegree);
    EXPECT_TRUE(change.mass.covers(along)) << change.bucket << ": " << change.mass.low << " to " << change.mass.high;
  }
  // What is found in 95 of 100 records is missed in 5.
  EXPECT_EQ(c.smallest_found < 2 * job.centrifuge.allowed, c.miss_rate < 0.05);
  EXPECT_LT(c.miss_rate, 0.5);
  EXPECT_EQ(c.summary.distrust(), nullptr);
}

TEST(CentrifugeReference, AnEvenLoadIsRightAndNamesNoBucket) {
  const RotorJob job = template_job();
  const LoadCheck c = check_rig(job, loading(0, 0));
  EXPECT_EQ(c.verdict, LoadVerdict::right);
  EXPECT_TRUE(c.named.empty());
  EXPECT_LT(c.imbalance.low, 1e-4);
}

/// A vibration once per turn that does not grow with speed is no imbalance.
TEST(CentrifugeReference, ADisturbanceThatDoesNotGrowIsRefused) {
  const RotorJob job = template_job();
  Recording record = testing::CentrifugeRigModel(loading(4, 30)).run();
  Eigen::VectorXd disturbed = record["housing"];
  const double size = 0.02;  // m/s^2
  disturbed += size * record["beta"].array().cos().matrix();
  Recording other;
  other.dt = record.dt;
  other.add("housing", Quantity::acceleration, disturbed);
  other.add("beta", Quantity::angle, record["beta"]);
  const LoadCheck c = check_load(job.rotor, job.centrifuge, order_run(other, 0, other["beta"], {"housing"}, "spin-up"),
                                 {centrifuge_sensors(job.rotor, job.centrifuge).front()});
  ASSERT_NE(c.summary.distrust(), nullptr) << c.misfit_deviations;
  EXPECT_EQ(c.summary.distrust()->code, FindingCode::model_error);
  EXPECT_EQ(c.summary.status, Status::unusable);
}

/// 8 g at 60 degrees.
OrderRun short_run(bool noise) {
  testing::CentrifugeRig rig = loading(8, 60);
  if (!noise) rig.noise_density = 0;
  rig.hold_seconds = 0;
  return spin_up(rig);
}

/// That run up to `blocks`, judged as one of other machines: 10 draws are enough for rules.
LoadCheck judged_as(const RotorJob& job, const OrderRun& run, Eigen::Index blocks = 12) {
  return check_load(job.rotor, job.centrifuge, run, {centrifuge_sensors(job.rotor, job.centrifuge).front()},
                    {.highest = 0.5 * (run.speed[blocks - 1] + run.speed[blocks]), .draws = 10});
}

// Wherever the first of however many buckets is.
TEST(CentrifugeRules, TheTwoBucketsBesideTheHeavySideHoldIt) {
  RotorJob job = template_job();
  job.centrifuge.tolerance = {};
  job.centrifuge.load = 0.4;
  const OrderRun run = short_run(false);
  std::mt19937 random(5);
  for (const int buckets : {3, 4, 8}) {
    for (int k = 0; k < 2; ++k) {
      job.centrifuge.buckets = buckets;
      job.centrifuge.first_bucket = std::uniform_real_distribution<double>(-10, 10)(random);
      const LoadCheck c = judged_as(job, run);
      ASSERT_EQ(c.changes.size(), 2u);
      EXPECT_EQ(c.changes[1].bucket, c.changes[0].bucket % buckets + 1);
      std::complex<double> sum = 0;
      for (const BucketChange& change : c.changes) {
        EXPECT_GE(change.mass.value, 0) << "between them, so that both are too heavy";
        sum += std::polar(change.mass.value, job.centrifuge.first_bucket + kTwoPi * (change.bucket - 1) / buckets);
      }
      EXPECT_LT(std::abs(sum - std::polar(c.imbalance.value, c.angle.value)), 0.02 * c.imbalance.value);
    }
  }
  // With two, the heavier one.
  for (const auto& [first, heavy] :
       {std::pair{0.0, 1}, std::pair{100.0, 1}, std::pair{200.0, 2}, std::pair{300.0, 2}}) {
    job.centrifuge.buckets = 2;
    job.centrifuge.first_bucket = first * kRadPerDegree;
    const LoadCheck c = judged_as(job, run);
    ASSERT_EQ(c.changes.size(), 1u);
    EXPECT_EQ(c.changes[0].bucket, heavy) << first;
    EXPECT_NEAR(c.changes[0].mass.value,
                c.imbalance.value * std::abs(std::cos(c.angle.value - job.centrifuge.first_bucket)), 1e-5);
  }
}

// Where tolerances hide an imbalance of any size, none is stated; elsewhere the one stated is at its own quantile.
TEST(CentrifugeRules, NoSmallestImbalanceIsStatedWhereTolerancesHideAny) {
  RotorJob job = template_job();
  const OrderRun run = short_run(true);
  for (const double allowed : {1e-3, 1e-2}) {
    job.centrifuge.allowed = allowed;
    job.centrifuge.tolerance.sensor_gain = 0.9;
    EXPECT_TRUE(std::isinf(judged_as(job, run).smallest_found)) << allowed;
    job.centrifuge.tolerance.sensor_gain = 0.05;
    const double found = judged_as(job, run).smallest_found;
    EXPECT_GT(found, allowed);
    EXPECT_LT(found, 0.1);  // kg
  }
}

// Chi-square counts the differences from block to block: a variance of so many pairs has so many degrees of freedom.
TEST(CentrifugeRules, TheMisfitCountsThePairsOfBlocks) {
  const RotorJob job = template_job();
  const OrderRun run = short_run(true);
  for (const Eigen::Index blocks : {8, 12}) {
    const LoadCheck c = judged_as(job, run, blocks);
    EXPECT_EQ(c.decided_at, run.speed[blocks - 1]);
    const double pairs = 0.5 * std::pow(c.misfit_deviations / (c.chi_square - 1), 2);
    EXPECT_NEAR(pairs, static_cast<double>(blocks - 1), 1e-6) << blocks;
  }
}

TEST(CentrifugeProperty, ShorterRecordsSayThatTheyAreOpen) {
  const RotorJob job = template_job();
  testing::CentrifugeRig rig = loading(3.3, 10);
  rig.hold_seconds = 2;
  const LoadCheck c = check_rig(job, rig);
  EXPECT_EQ(c.verdict, LoadVerdict::open);
  EXPECT_GT(c.seconds_more, 1);
}

TEST(CentrifugeProperty, LimitsFollowTheImbalanceAndTheSafety) {
  const RotorJob job = template_job();
  const std::vector<double> speeds{20, 60, 150};
  const SpeedLimits one = speed_limits(job.rotor, job.centrifuge, speeds, 2);
  CentrifugeSetup other = job.centrifuge;
  other.allowed *= 3;
  const SpeedLimits three = speed_limits(job.rotor, other, speeds, 2),
                    four = speed_limits(job.rotor, job.centrifuge, speeds, 4);
  EXPECT_TRUE(three.trip.isApprox(3 * one.trip, 1e-9));
  EXPECT_TRUE(four.trip.isApprox(2 * one.trip, 1e-9));
  EXPECT_TRUE((one.trip.array() >= 2 * one.expected.array()).all());
  EXPECT_TRUE((one.caught.array() >= 2 * job.centrifuge.allowed).all());
  EXPECT_EQ(one.sensors.size(), 2u);
}

TEST(CentrifugeFile, BadInputNamesWhatIsMissing) {
  const auto message = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  std::string text = rotor_template("centrifuge");
  const std::string on = "on = \"motor\"\nposition_mm = 200";
  text.replace(text.find(on), on.size(), "on = \"casing\"\nposition_mm = 200");
  EXPECT_NE(message([&] { parse_rotor_job(text, "r.toml"); }).find("accelerometer[0].on"), std::string::npos);
  const RotorJob plain = parse_rotor_job(rotor_template("two-disc"), "two-disc");
  EXPECT_NE(message([&] { speed_limits(plain.rotor, plain.centrifuge, {10}); }).find("[centrifuge]"),
            std::string::npos);
  const RotorJob job = template_job();
  testing::CentrifugeRig fast = loading(3, 0);
  fast.from = 25;
  fast.hold = 30;
  EXPECT_NE(message([&] { check_rig(job, fast); }).find("spin up slower"), std::string::npos);
}

}  // namespace
}  // namespace whirl::shaft
