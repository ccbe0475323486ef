// A rotor seen along one axis: taken as one whose axes are alike, which is said; what that cannot hold is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <tuple>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::identification {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

Recording without(Recording record, const std::string& channel) {
  std::erase_if(record.channels, [&](const Channel& c) { return c.name == channel; });
  return record;
}

Eigen::VectorXd& samples_of(Recording& record, const std::string& channel) {
  for (Channel& c : record.channels) {
    if (c.name == channel) return c.samples;
  }
  throw std::invalid_argument("no such channel");
}

Recording record_of(unsigned seed, double snr) { return machine_record(draw_machine(Oddity::none, seed), snr, seed); }

TEST(OneAxisProperty, TheRotorIsFoundAlongEitherAxisAndTheIntervalsCover) {
  int covered = 0, intervals = 0;
  for (unsigned seed = 301; seed < 313; ++seed) {
    SCOPED_TRACE(seed);
    const Machine truth = draw_machine(Oddity::none, seed).machine;
    const char* unseen = seed % 2 == 0 ? "x" : "y";
    const RotorIdentification found =
        identify_rotor_detailed(std::vector<Recording>{without(record_of(seed, 40), unseen)});
    const IdentifiedModel& m = found.model;
    ASSERT_EQ(m.summary.status, Status::warning) << m.summary.warnings.front();
    EXPECT_THAT(m.summary.warnings, Contains(HasSubstr("there is no channel " + std::string(unseen))));
    EXPECT_TRUE(found.added.empty()) << found.added.front();
    EXPECT_LT(m.summary.chi_square, 1.3);
    ASSERT_EQ(found.assumptions.size(), 2u);
    EXPECT_THAT(found.assumptions.front(), HasSubstr("isotropic rotor"));
    EXPECT_EQ(m.parameter(std::string("offset_") + unseen), nullptr);
    for (const auto& [name, value, share] :
         {std::tuple("k1", truth.k, 2e-4), std::tuple("k2", truth.cubic, 2e-2), std::tuple("c", truth.c, 1e-2),
          std::tuple("e", truth.e, 5e-3), std::tuple("e_phase", truth.e_phase, 1e9)}) {
      const Estimate& e = *m.parameter(name);
      const double error =
          std::string(name) == "e_phase" ? std::remainder(e.value - value, 2 * std::numbers::pi) : e.value - value;
      EXPECT_LT(std::abs(error), share * std::abs(value)) << name;
      EXPECT_LT(std::abs(error), 4.5 * e.sd) << name;
      covered += std::abs(error) < 1.96 * e.sd;
      ++intervals;
    }
  }
  EXPECT_GE(covered, intervals * 0.85);
}

// Half the readings: the deviations grow by the root of two, and by what the unseen axis leaves open.
TEST(OneAxisProperty, OneAxisIsLessCertainThanTwo) {
  for (const unsigned seed : {321U, 322U, 323U}) {
    const Recording both = record_of(seed, 40);
    const OutputErrorFit two = identify_rotor_detailed(std::vector<Recording>{both}).fit,
                         one = identify_rotor_detailed(std::vector<Recording>{without(both, "y")}).fit;
    for (const char* name : {"k1", "c", "eps_re"}) {
      const auto sd = [&](const OutputErrorFit& f) { return std::sqrt(f.covariance(f.index(name), f.index(name))); };
      EXPECT_GT(sd(one) / sd(two), 1.2) << name << " seed " << seed;
      EXPECT_LT(sd(one) / sd(two), 2.5) << name << " seed " << seed;
    }
  }
}

// A probe that is dead is named, with what to do; without its channel the other one serves, and what is held out is
// predicted along it.
TEST(OneAxisProperty, ADeadProbeIsRefusedAndLeftOutServes) {
  const Machine truth = draw_machine(Oddity::none, 331).machine;
  Recording r = record_of(331, 40);
  samples_of(r, "y").setZero();
  const Identification dead = identify(r);
  EXPECT_FALSE(dead.usable());
  EXPECT_THAT(dead.summary.warnings, Contains(HasSubstr("leave the channel out")));
  const Identification id = identify(without(r, "y"));
  ASSERT_TRUE(id.usable()) << id.summary.warnings.back();
  EXPECT_NEAR(id.model.parameter("k1")->value, truth.k, 5e-4 * truth.k);
  EXPECT_NEAR(id.model.parameter("e")->value, truth.e, 1e-2 * truth.e);
  ASSERT_EQ(id.evidence.held_out.scores.size(), 1u) << id.evidence.held_out.reason;
  EXPECT_EQ(id.evidence.held_out.scores.front().state, "x");
  EXPECT_EQ(id.evidence.assumptions.size(), 2u);
  EXPECT_THROW(identify_paper(without(r, "y")), Error);
}

// Axes that differ by 2 % along unknown directions: no model, or the truth inside its intervals.
TEST(OneAxisProperty, UnequalAxesAreNotTakenForOthersInSilence) {
  int refused = 0, wrong = 0;
  for (unsigned seed = 351; seed < 355; ++seed) {
    const Machine truth = draw_machine(Oddity::anisotropic, seed).machine;
    const RotorIdentification found = identify_rotor_detailed(
        std::vector<Recording>{without(machine_record(draw_machine(Oddity::anisotropic, seed), 40, seed), "y")});
    if (found.model.summary.status == Status::unusable) {
      ++refused;
      continue;
    }
    const Estimate& e = *found.model.parameter("e");
    wrong += std::abs(e.value - truth.e) > 5 * e.sd && std::abs(e.value - truth.e) > 0.05 * truth.e;
  }
  EXPECT_GE(refused, 2);
  EXPECT_EQ(wrong, 0);
}

// Wrong records are refused, or at least nothing beyond its interval is stated as sure.
TEST(OneAxisProperty, WrongRecordsAreRefused) {
  for (const unsigned seed : {341U, 342U}) {
    const Recording sound = without(record_of(seed, 40), "y");
    const auto refused = [&](const char* what, const Recording& r) {
      const Identification id = identify(r);
      EXPECT_FALSE(id.usable()) << what << " seed " << seed;
    };
    Recording r = sound;
    samples_of(r, "beta") *= 180 / std::numbers::pi;
    refused("angle in degrees", r);
    r = sound;
    samples_of(r, "x") *= 1e3;
    refused("mm for m", r);
    r = sound;
    samples_of(r, "beta") *= 0.5;
    refused("two pulses a turn", r);
    r = sound;
    samples_of(r, "x").reverseInPlace();
    refused("time of the motion reversed", r);
    r = sound;
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (double& v : samples_of(r, "x")) v = 1e-4 * normal(random);
    refused("noise", r);
  }
}

}  // namespace
}  // namespace whirl::identification
