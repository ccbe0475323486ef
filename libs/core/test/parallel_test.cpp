#include "whirl/core/parallel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace whirl;
using testing::ElementsAre;

TEST(ParallelProperty, TrialsAreTakenInOrderUntilTheEndForAnyGroup) {
  for (int group = 1; group <= 9; ++group) {
    std::vector<int> squares(8, -1), taken;
    int sum = 0;
    parallel_trials(
        8, group, [&] { return sum > 20; }, [&](int i) { squares[static_cast<std::size_t>(i)] = i * i; },
        [&](int i) { taken.push_back(i), sum += squares[static_cast<std::size_t>(i)]; });
    EXPECT_THAT(taken, ElementsAre(0, 1, 2, 3, 4)) << group;  // 0 + 1 + 4 + 9 + 16 is above 20
  }
}

TEST(ParallelProperty, ASlowTrialHoldsUpNoOtherButAtMostSoManyWaitForIt) {
  constexpr int kTrials = 40, kMost = 6;
  if (processors() < 2) GTEST_SKIP() << "one core";
  std::atomic<int> started{0}, most{0};
  std::vector<int> taken;
  parallel_trials(
      kTrials, kMost, [] { return false; },
      [&](int i) {
        ++started;
        // The first one lasts until as many as may be held have begun: with groups of two it would never end.
        while (i == 0 && started < kMost) std::this_thread::yield();
      },
      [&](int i) {
        most = std::max(most.load(), started - static_cast<int>(taken.size()));
        taken.push_back(i);
      });
  ASSERT_EQ(taken.size(), static_cast<std::size_t>(kTrials));
  EXPECT_TRUE(std::ranges::is_sorted(taken));
  EXPECT_LE(most, kMost);
}

TEST(ParallelProperty, NoneIsRunWhereTheEndIsReachedBefore) {
  int runs = 0;
  parallel_trials(
      4, 2, [] { return true; }, [&](int) { ++runs; }, [](int) {});
  EXPECT_EQ(runs, 0);
}

TEST(ParallelProperty, TheExceptionOfATrialReachesTheCaller) {
  const auto fail = [](int i) {
    if (i == 3) throw std::runtime_error("third");
  };
  EXPECT_THROW(parallel_trials(
                   6, 2, [] { return false; }, fail, [](int) {}),
               std::runtime_error);
  EXPECT_NO_THROW(parallel_trials(
      0, 1, [] { return false; }, fail, [](int) {}));
}
