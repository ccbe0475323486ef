#include "whirl/rt/drivers/tick_alignment.hpp"

#include <gtest/gtest.h>

#include <random>

namespace whirl::rt {
namespace {

// Samples arrive bunched, late by themselves, and now and then after ticks that were held back: a twentieth at most.
TEST(TickAlignmentProperty, TheOffsetIsTheOneOfPunctualSamples) {
  std::mt19937_64 random(90001);
  const auto draw = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
  for (int trial = 0; trial < 200; ++trial) {
    const std::int64_t truth = draw(-100000, 100000);
    const int bunch = draw(1, 8), every = draw(24, 100);
    TickAlignment alignment;
    EXPECT_FALSE(alignment.known());
    std::int64_t second = 0;
    for (std::int64_t tick = 500; tick < 1000; ++tick) {
      const bool held_back = tick % every == 0;
      const std::int64_t seen = held_back ? tick - draw(1, 50) : tick;
      alignment.see(seen, seen - second);            // before the sample of this tick
      if (tick % bunch == 0) second = tick - truth;  // which comes now
      alignment.see(seen, seen - second);
    }
    EXPECT_TRUE(alignment.known());
    EXPECT_EQ(alignment.offset(), truth) << "bunches of " << bunch << ", late every " << every;
    alignment.move(-3);
    EXPECT_EQ(alignment.offset(), truth - 3);
    for (std::int64_t tick = 1000; tick < 1128; ++tick) alignment.see(tick, 7);
    EXPECT_EQ(alignment.offset(), 7) << "what was before is forgotten";
  }
}

}  // namespace
}  // namespace whirl::rt
