// Channels that are not read at the same instants.
#include "whirl/identify/record/channel_instants.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"
#include "whirl/testing/systems/identified_oscillator.hpp"

namespace whirl::identification {
namespace {

using testing::DrivenOscillator;
using testing::identified_oscillator;

bool says_late(const Identification& id) { return testing::warns_of(id, "channel v is read"); }

TEST(ChannelInstantsProperty, AVelocityReadLateIsFoundAndTheMachineWithIt) {
  for (unsigned seed = 61; seed <= 66; ++seed) {
    const DrivenOscillator machine = testing::drawn_oscillator(seed);
    const double late = 0.25 * (1 + seed % 3);
    const Identification id =
        identified_oscillator({driven_record(machine, {.seed = seed, .noise = 0.01, .late = late})});
    EXPECT_TRUE(says_late(id)) << seed;
    for (const auto& [name, value] : machine.truth()) {
      const Estimate* e = id.model.parameter(name);
      ASSERT_NE(e, nullptr) << seed << " " << name;
      EXPECT_LT(std::abs(e->value - value), 4 * e->sd) << seed << " " << name;
      EXPECT_NEAR(e->value, value, 0.03 * std::abs(value)) << seed << " " << name;
    }
  }
}

TEST(ChannelInstantsProperty, ChannelsReadTogetherAreLeft) {
  for (unsigned seed = 71; seed <= 80; ++seed) {
    const double noise = seed % 2 == 0 ? 0.002 : 0.03;
    const Identification id =
        identified_oscillator({driven_record(testing::drawn_oscillator(seed), {.seed = seed, .noise = noise})});
    EXPECT_FALSE(says_late(id)) << seed;
    EXPECT_EQ(id.summary.status, Status::ok) << seed;
  }
}

TEST(ChannelInstantsProperty, AStateThatIsNotQuiteARateIsNotCalledLate) {
  testing::Tally tally;
  for (unsigned seed = 81; seed <= 88; ++seed) {
    DrivenOscillator machine = testing::drawn_oscillator(seed);
    machine.leak = 0.05 * std::sqrt(machine.stiffness);
    const Identification id = identified_oscillator({driven_record(machine, {.seed = seed, .noise = 0.01})});
    EXPECT_FALSE(says_late(id)) << seed;
    EXPECT_EQ(id.summary.status, Status::ok) << seed;
    tally.add(id, machine);
  }
  EXPECT_EQ(tally.far, 0);
}

TEST(ChannelInstantsReference, ASineIsMovedToItsInstants) {
  constexpr Eigen::Index kSamples = 400;
  Recording r;
  r.dt = 0.01;
  Eigen::VectorXd v(kSamples), truth(kSamples);
  const auto at = [](double t) { return std::sin(2 * std::numbers::pi * 3 * t + 0.4); };
  for (Eigen::Index i = 0; i < kSamples; ++i) {
    truth[i] = at(0.01 * static_cast<double>(i));
    v[i] = at(0.01 * static_cast<double>(i) + 0.004);
  }
  r.add("v", Quantity::velocity, v);
  Eigen::VectorXd w = v;
  w[200] = NAN;
  r.add("w", Quantity::velocity, w);
  const Recording moved = at_common_instants(at_common_instants(r, {"v", 0.004}), {"w", 0.004});
  ASSERT_EQ(moved.size(), kSamples - 2);
  EXPECT_DOUBLE_EQ(moved.t0, 0.02);
  EXPECT_LT((moved["v"] - truth.tail(kSamples - 2)).segment(20, kSamples - 40).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_TRUE(moved["v"].allFinite());
  EXPECT_TRUE(std::isnan(moved["w"][198]));
  EXPECT_TRUE(std::isnan(moved["w"][199]));  // nothing was read before
  EXPECT_THROW(at_common_instants(r, {"v", 5}), Error);
  EXPECT_THROW(at_common_instants(r, {"z", 0.004}), Error);
}

TEST(LateChannel, TextIsAChannelAndSeconds) {
  EXPECT_EQ(late_channel("v=0.005").channel, "v");
  EXPECT_DOUBLE_EQ(late_channel("v=-5e-3").seconds, -0.005);
  for (const char* wrong : {"v", "=0.1", "v=", "v=0.1s", "v=inf"}) EXPECT_THROW(late_channel(wrong), Error) << wrong;
}

}  // namespace
}  // namespace whirl::identification
