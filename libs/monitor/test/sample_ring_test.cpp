#include "whirl/monitor/sample_ring.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "whirl/core/error.hpp"

namespace whirl::monitor {
namespace {

TEST(MonitorRing, FullRingRefusesAndCounts) {
  SampleRing ring(2, 3);  // rounded up to 4
  ASSERT_EQ(ring.capacity(), 4U);
  for (std::uint64_t k = 0; k < 6; ++k) {
    const double row[] = {static_cast<double>(k), -1};
    EXPECT_EQ(ring.push(k, row), k < 4);
  }
  EXPECT_EQ(ring.dropped(), 2U);
  std::uint64_t tick = 99;
  double row[2];
  ASSERT_TRUE(ring.peek(tick));
  EXPECT_EQ(tick, 0U);
  for (std::uint64_t k = 0; k < 4; ++k) {
    ASSERT_TRUE(ring.pop(tick, row));
    EXPECT_EQ(tick, k);
    EXPECT_EQ(row[0], static_cast<double>(k));
  }
  EXPECT_FALSE(ring.pop(tick, row));
  EXPECT_THROW(SampleRing(0, 16), Error);
}

TEST(MonitorRingProperty, RowsArriveWholeAndInOrderBetweenThreads) {
  SampleRing ring(3, 64);
  constexpr std::uint64_t kRows = 200'000;
  std::thread producer([&] {
    for (std::uint64_t k = 0; k < kRows; ++k) {
      const double v = static_cast<double>(k);
      const double row[] = {v, 2 * v, -v};
      ring.push(k, row);
      if (k % 64 == 0) std::this_thread::yield();
    }
  });
  std::uint64_t tick = 0, received = 0, last = 0;
  double row[3];
  bool whole = true, ordered = true;
  const auto take = [&] {
    while (ring.pop(tick, row)) {
      const double v = static_cast<double>(tick);
      whole = whole && row[0] == v && row[1] == 2 * v && row[2] == -v;
      ordered = ordered && (received == 0 || tick > last);
      last = tick;
      ++received;
    }
  };
  while (received + ring.dropped() < kRows) take();
  producer.join();
  take();
  EXPECT_TRUE(whole);
  EXPECT_TRUE(ordered);
  EXPECT_EQ(received + ring.dropped(), kRows);
  EXPECT_GE(received, 64U);  // the ring itself holds that many
}

}  // namespace
}  // namespace whirl::monitor
