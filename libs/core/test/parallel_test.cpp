#include "whirl/core/parallel.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
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
