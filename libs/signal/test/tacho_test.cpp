#include "whirl/signal/tacho.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/testing/systems/tachos.hpp"

namespace whirl::signal {
namespace {

constexpr double kWholeTurn = 2 * std::numbers::pi;

struct TachoTally {
  int right = 0, refused = 0, wrong = 0;
};

/// Largest error of the speed in the middle eight tenths, as a share of the highest one.
double speed_error(const testing::TachoRecord& seen, const AngleFit& fit) {
  const Eigen::Index n = seen.volts.size(), first = n / 10, count = n - 2 * first;
  const Eigen::VectorXd speed = fit.angle.omega(Eigen::seqN(2 * first, count, Eigen::Index{2})) / kWholeTurn;
  const Eigen::VectorXd truth = seen.speed.segment(first, count);
  return std::sqrt((speed - truth).squaredNorm() / static_cast<double>(count)) / truth.maxCoeff();
}

TachoTally tally_of(int seeds, double chance, bool stated, int first = 0, int base = 100) {
  TachoTally tally;
  for (int seed = first; seed < seeds; ++seed) {
    std::mt19937_64 random(static_cast<unsigned>(base + seed));
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (const testing::Wheel& wheel : testing::wheels(random)) {
      testing::TachoRun run;
      run.seconds = between(5, 12);
      run.slow = between(2, 6);
      run.fast = between(12, 40);
      run.bend = between(0.6, 1.8);
      run.ripple = between(0, 0.001);
      run.ripple_hz = run.slow * between(0.05, 0.2);  // slower than five turns: one mark sees it
      run.down = seed % 2 == 1;
      const double rate = 20 * run.fast * std::max(24, wheel.places) / between(1, 2);
      const testing::TachoRecord seen = tacho_record(wheel, run, rate, chance, seed % 3 == 0 ? 0.6 : 0, random);
      Recording record;
      record.dt = seen.dt;
      record.source = wheel.name;
      record.add("tacho", Quantity::voltage, seen.volts);
      std::vector<std::string> said;
      TachoOptions tacho;
      if (stated) tacho.pulses = wheel.places;
      try {
        const AngleFit fit = angle_of_tacho(record, "", tacho, said);
        const double error = speed_error(seen, fit);
        const bool right = error < 5e-4;
        (right ? tally.right : tally.wrong)++;
        EXPECT_TRUE(right) << wheel.name << " seed " << seed << ": " << error << "; " << said.front() << "; lost "
                           << seen.lost << " of " << fit.missing << ", added " << seen.added << " of " << fit.extra;
      } catch (const Error&) {
        ++tally.refused;
      }
    }
  }
  return tally;
}

TEST(TachoProperty, TheSpeedOfTwelveWheelsIsRightOrRefused) {
  const TachoTally tally = tally_of(5, 0.0, false);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 57);
}

// Seven magnets at 34 samples a pulse were taken for two a turn that are even within 0.2 %.
TEST(TachoProperty, AFewMarksThatAreEvenAreNotTakenForATurn) {
  const TachoTally tally = tally_of(6, 0.0, false, 5, 71000);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 10);
}

TEST(TachoProperty, LostAndAddedPulsesLeaveTheSpeedRightOrRefused) {
  const TachoTally tally = tally_of(10, 0.01, false);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 108);
}

// As many lost teeth as gaps of the wheel: 36-1 and 60-2 wheels were taken for one pulse a turn.
TEST(TachoProperty, ThreePercentLostAndAddedLeaveAWheelAWheel) {
  const TachoTally tally = tally_of(10, 0.03, false, 5, 94000);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 56);
}

TEST(TachoProperty, AStatedNumberOfPulsesIsTaken) {
  const TachoTally tally = tally_of(3, 0.01, true);
  EXPECT_EQ(tally.wrong, 0);
  EXPECT_GE(tally.right, 34);
}

/// A shaft at 20 to 25 turns a second on which an unbalance acts, with the tacho of `wheel`.
Recording vibrating(const testing::Wheel& wheel, unsigned seed, double rate = 20000) {
  std::mt19937_64 random(seed);
  testing::TachoRun run;
  run.seconds = 4, run.slow = 20, run.fast = 25;
  const testing::TachoRecord seen = tacho_record(wheel, run, rate, 0, 0.6, random);
  Recording record;
  record.dt = seen.dt;
  record.source = "made";
  record.add("x", Quantity::displacement, 1e-4 * (kWholeTurn * seen.turns.array()).cos().matrix());
  record.add("tacho", Quantity::voltage, seen.volts);
  record.add("turns", Quantity::dimensionless, seen.turns);
  return record;
}

std::string refusal_of(const Recording& record, const TachoOptions& tacho) {
  std::vector<std::string> said;
  try {
    angle_of_tacho(record, "", tacho, said);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

// Their number cannot be told from the pulses; the vibration contradicts one a turn.
TEST(Tacho, EvenPulsesAgainstTheVibrationAskForTheirNumber) {
  std::mt19937_64 random(3);
  for (const int places : {4, 16, 44}) {
    const Recording record = vibrating(testing::toothed("even", places, {}, 0, random), 8);
    const std::string refused = refusal_of(record, {});
    EXPECT_NE(refused.find("about 1/" + std::to_string(places)), std::string::npos) << places << refused;
    std::vector<std::string> said;
    const AngleFit fit = angle_of_tacho(record, "", {places, -1, Edge::automatic}, said);
    EXPECT_NEAR(fit.angle.omega[record.size()] / kWholeTurn, 22.5, 0.01);
  }
  const Recording one = vibrating(testing::wheel_of("one", {0.2}, 0.05, 1), 9);
  EXPECT_EQ(refusal_of(one, {}), "");
}

TEST(Tacho, MoreThan120000RpmAskForThePulsesATurn) {
  std::mt19937_64 random(3);
  Recording record = vibrating(testing::toothed("even", 120, {}, 0, random), 8, 40000);
  std::erase_if(record.channels, [](const Channel& c) { return c.name == "x"; });
  EXPECT_NE(refusal_of(record, {}).find("rpm with one a turn"), std::string::npos);
}

// A notch pulls the signal down: its leading edge falls. Its width was in every phase.
TEST(Tacho, TheAngleOfANotchCountsFromItsLeadingEdge) {
  testing::Wheel notch = testing::wheel_of("notch", {0.2}, 0.03, 1);
  notch.notch = true;
  const Recording record = vibrating(notch, 4);
  const auto off = [&](const TachoOptions& tacho) {
    std::vector<std::string> said;
    const AngleFit fit = angle_of_tacho(record, "", tacho, said);
    const Eigen::Index i = record.size() / 2;
    return 360 * std::remainder(fit.angle.beta[2 * i] / kWholeTurn - (record["turns"][i] - 0.2), 1.0);
  };
  EXPECT_NEAR(off({}), 0, 0.3);
  EXPECT_NEAR(off({0, -1, Edge::rising}), -10.8, 0.3);
}

TEST(Tacho, TheZeroOfAWheelFollowsItsLongestGap) {
  std::mt19937_64 random(3);
  const Recording record = vibrating(testing::toothed("36-1", 36, {35}, 0, random), 6);
  std::vector<std::string> said;
  const AngleFit fit = angle_of_tacho(record, "", {}, said);
  EXPECT_EQ(fit.pattern.places, 36);
  EXPECT_EQ(fit.pattern.missing(), 1);
  const Eigen::Index i = record.size() / 2;
  EXPECT_NEAR(360 * std::remainder(fit.angle.beta[2 * i] / kWholeTurn - (record["turns"][i] - 0.1 / 36), 1.0), 0, 0.3);
  EXPECT_NE(refusal_of(record, {60, 2, Edge::automatic}).find("36 places"), std::string::npos);
  EXPECT_NE(refusal_of(record, {36, 2, Edge::automatic}).find("2 places"), std::string::npos);
}

// A filter behind the converter gives an edge of three samples that tells no more than one: such wheels looked uneven,
// two marks a turn.
TEST(Tacho, EdgesSmearedAfterSamplingAreKnownToASampleOnly) {
  std::mt19937_64 random(3);
  Recording record = vibrating(testing::toothed("36-1", 36, {35}, 0, random), 6, 12000);
  Channel& tacho = record.channels[1];
  const Eigen::VectorXd raw = (tacho.samples.array() > 2.5).cast<double>();
  for (Eigen::Index i = 1; i + 1 < raw.size(); ++i) tacho.samples[i] = 5 * (raw[i - 1] + raw[i] + raw[i + 1]) / 3;
  EXPECT_EQ(pulse_train(tacho.samples, record.dt).quantum, record.dt);
  std::vector<std::string> said;
  const AngleFit fit = angle_of_tacho(record, "", {}, said);
  EXPECT_EQ(fit.pattern.places, 36);
  EXPECT_EQ(fit.pattern.missing(), 1);
}

// 60 teeth of 3.3 samples: the place of an edge is known to a third of a tooth.
TEST(Tacho, AWheelSampledTooSlowlyIsNamed) {
  Recording r;
  r.dt = 2e-4;
  Eigen::VectorXd tooth(20000);
  for (Eigen::Index i = 0; i < tooth.size(); ++i) {
    const double turns = 25 * r.dt * static_cast<double>(i) + 0.111, part = 60 * turns - std::floor(60 * turns);
    tooth[i] = part < 0.5 ? 5 : 0;
  }
  r.add("tacho", Quantity::voltage, tooth);
  std::vector<std::string> said;
  try {
    angle_of_tacho(r, "", {}, said);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("3.3 samples: the channel is sampled too slowly"), std::string::npos)
        << e.what();
  }
}

TEST(Tacho, ASpeedIsIntegratedAndHasNoPhase) {
  Recording record;
  record.dt = 1e-3;
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(5000, 0, 4.999);
  record.add("speed", Quantity::angular_velocity, (100 + 20 * t).matrix());
  std::vector<std::string> said;
  const Recording out = with_tacho_angle(record, "", {}, said);
  EXPECT_NEAR(out["beta"][4000] - out["beta"][0], 100 * 4.0 + 10 * 16, 1e-3);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_NE(said[0].find("unknown zero"), std::string::npos);
}

}  // namespace
}  // namespace whirl::signal
